/**
 * An HTML for each page (`dist/pages`), and which address opens which (`routes.json`, for `server/http/pages.py`). In it are the
 * header with its styles, painted before anything else has come, links to all styles of the page, and a template with links to
 * its code: once the header is painted, the browser asks for all of it together and not one after another (public/frame.js).
 */
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs'
import { join } from 'node:path'
import type { Plugin, Rolldown } from 'vite'
import { frameHtml } from '../src/frame'
import { headOf, nameOf } from '../src/heads'
import { EVERYWHERE, FIRST_QUESTIONS, ROUTES } from '../src/routes'

type Bundle = Rolldown.OutputBundle
type Chunk = Rolldown.OutputChunk

const STYLE_SHEET = /^\s*<link rel="stylesheet"[^>]*>\n?/gm
const ENTRY = /^\s*<script type="module"[^>]* src="([^"]+)"><\/script>\n?/m
const FRAME = '<div id="frame">'
const ROOT = '<div id="root">'
const LAST = '</template>'

export function pages(): Plugin {
  const style = readFileSync(join(import.meta.dirname, '../src/frame.css'), 'utf8')
  return {
    name: 'pages',
    transformIndexHtml: {
      order: 'post',
      handler: (html, { bundle }) => {
        const framed = html
          .replace('<!-- frame.css -->', `<style>${bundle ? smaller(style) : style}</style>`)
          .replace('<!-- frame -->', frameHtml(''))
        if (!bundle) return framed
        // Style sheets stand behind the frame and hold back only what follows; the script starts after the first picture.
        const sheets = framed.match(STYLE_SHEET) ?? []
        const entry = ENTRY.exec(framed)?.[1]
        if (!entry) throw new Error('index.html has no entry')
        return framed
          .replace(STYLE_SHEET, '')
          .replace(ENTRY, `<template id="code">${link('modulepreload', entry)}${LAST}\n`)
          .replace('<script src="/frame.js">', `<script src="/frame.js" data-entry="${entry}">`)
          .replace(ROOT, `${sheets.join('')}${ROOT}`)
      },
    },
    writeBundle: ({ dir }, bundle) => {
      if (!dir) return
      const html = readFileSync(join(dir, 'index.html'), 'utf8')
      mkdirSync(join(dir, 'pages'), { recursive: true })
      const routes: [pattern: string, file: string, asked: string[]][] = []
      for (const [path, name] of Object.entries(ROUTES)) {
        const head = headOf(name)
        const called = nameOf(name)
        const questions = FIRST_QUESTIONS[name] ?? []
        const named = called && questions[0] ? { name: called, question: questions[0] } : undefined
        const { code, styles } = partsOf(bundle, name)
        const links = (rel: string, files: Iterable<string>) =>
          [...files]
            .filter((file) => !html.includes(file))
            .map((file) => link(rel, `/${file}`))
            .join('')
        const page = html
          .replace(LAST, `${links('modulepreload', code)}${LAST}`)
          .replace(ROOT, `${links('stylesheet', styles)}${ROOT}`)
          .replace(new RegExp(`${FRAME}.*`), frameHtml(path.replace(/\/:.*/, ''), head, named))
          .replace('<title>Mapless', `<title>${head ? `${head.title} – ` : ''}Mapless`)
        writeFileSync(join(dir, 'pages', `${name}.html`), page)
        if (path === '*') continue
        routes.push([patternOf(path), `${name}.html`, [...EVERYWHERE, ...questions]])
      }
      writeFileSync(join(dir, 'pages', 'routes.json'), JSON.stringify(routes))
    },
  }
}

const link = (rel: string, href: string) =>
  `<link rel="${rel}" crossorigin${rel === 'modulepreload' ? ' fetchpriority="low"' : ''} href="${href}">`

const smaller = (css: string) =>
  css
    .replace(/\/\*[\s\S]*?\*\//g, '')
    .replace(/\s+/g, ' ')
    .trim()

/** "/runs/:runId" as a regular expression of the server's language. */
const patternOf = (path: string) =>
  path.replace(/\/:(\w+)\?/g, '(/(?P<$1>[^/]+))?').replace(/:(\w+)/g, '(?P<$1>[^/]+)')

/** The files that a page cannot be drawn without. */
function partsOf(bundle: Bundle, name: string): { code: Set<string>; styles: Set<string> } {
  const chunks = Object.values(bundle).filter((file): file is Chunk => file.type === 'chunk')
  const first = chunks.find(({ facadeModuleId }) => facadeModuleId?.endsWith(`/pages/${name}.tsx`))
  if (!first) throw new Error(`no chunk for pages/${name}.tsx`)
  const code = new Set<string>()
  const styles = new Set<string>()
  const add = (chunk: Chunk) => {
    if (code.has(chunk.fileName)) return
    code.add(chunk.fileName)
    for (const file of chunk.imports) {
      const next = bundle[file]
      if (next?.type === 'chunk') add(next)
    }
    for (const sheet of chunk.viteMetadata?.importedCss ?? []) styles.add(sheet)
  }
  add(first)
  return { code, styles }
}
