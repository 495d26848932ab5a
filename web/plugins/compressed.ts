/** Each asset a second and a third time, as small as it gets: the server sends these to whoever takes them (`server/http/pages.py`). */
import { writeFileSync } from 'node:fs'
import { join } from 'node:path'
import { brotliCompressSync, gzipSync } from 'node:zlib'
import type { Plugin } from 'vite'

/** Below this, in bytes, a packet holds it anyway. */
const WORTH_IT = 1_000

export function compressed(): Plugin {
  return {
    name: 'compressed',
    apply: 'build',
    writeBundle: ({ dir }, bundle) => {
      for (const file of Object.values(bundle)) {
        const content = Buffer.from(file.type === 'chunk' ? file.code : file.source)
        if (!dir || !/^assets\/.*\.(js|css|svg)$/.test(file.fileName) || content.length < WORTH_IT) continue
        writeFileSync(join(dir, `${file.fileName}.br`), brotliCompressSync(content))
        writeFileSync(join(dir, `${file.fileName}.gz`), gzipSync(content, { level: 9 }))
      }
    },
  }
}
