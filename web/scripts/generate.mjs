/**
 * Writes src/api/schema.ts from openapi.json (which `python -m server.written.openapi` writes); with --check, writes nothing and
 * fails where the committed file differs.
 */
import { readFile, writeFile } from 'node:fs/promises'
import openapiTypeScript, { astToString, COMMENT_HEADER } from 'openapi-typescript'

const source = new URL('../openapi.json', import.meta.url)
const target = new URL('../src/api/schema.ts', import.meta.url)

const types = COMMENT_HEADER + astToString(await openapiTypeScript(source, { alphabetize: true }))

if (process.argv.includes('--check')) {
  const committed = await readFile(target, 'utf8').catch(() => '')
  if (committed !== types) {
    process.stderr.write('src/api/schema.ts is older than openapi.json: run `npm run generate`.\n')
    process.exit(1)
  }
} else {
  await writeFile(target, types)
}
