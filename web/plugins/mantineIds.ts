/** Mantine's components take their ids from `src/lib/useId.ts`, which says why. */
import { join } from 'node:path'
import type { Plugin } from 'vite'

const THEIRS = '/@mantine/hooks/esm/use-id/use-id.mjs'
const OURS = join(import.meta.dirname, '../src/lib/useId.ts')

export function mantineIds(): Plugin {
  let replaced = false
  return {
    name: 'mantine-ids',
    apply: 'build',
    enforce: 'pre',
    load: (id) => {
      if (!id.endsWith(THEIRS)) return null
      replaced = true
      return `export { useId } from ${JSON.stringify(OURS)}`
    },
    buildEnd(error) {
      if (!error && !replaced) this.error(`Mantine's useId is no longer in ${THEIRS}.`)
    },
  }
}
