/**
 * Of Mantine's styles only those of the components in use, each with the code that needs it. They are in a layer, so that
 * the pages' own rules win wherever they stand.
 */
import { existsSync } from 'node:fs'
import { join } from 'node:path'
import type { Plugin } from 'vite'

const CLASSES = /@mantine\/(core|notifications)\/esm\/.*\/(\w+)\.module\.mjs$/
const LAYERED = join(import.meta.dirname, '../node_modules/@mantine/core/styles')

export function mantineStyles(): Plugin {
  return {
    name: 'mantine-styles',
    enforce: 'pre',
    transform: (code, id) => {
      const component = CLASSES.exec(id)?.[2]
      const sheet = `${component}.layer.css`
      if (!component || !existsSync(join(LAYERED, sheet))) return null
      return { code: `import '@mantine/core/styles/${sheet}'\n${code}`, map: null }
    },
  }
}
