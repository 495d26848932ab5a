/**
 * The frame in index.html is painted before any style sheet has come: they stand behind it and hold back only what follows, the
 * application, whose own styles come last and win.
 */
import type { Plugin } from 'vite'

const STYLE_SHEET = /^\s*<link rel="stylesheet"[^>]*>\n?/gm

export function frameFirst(): Plugin {
  return {
    name: 'frame-first',
    transformIndexHtml: {
      order: 'post',
      handler: (html) => {
        const sheets = html.match(STYLE_SHEET) ?? []
        return html.replace(STYLE_SHEET, '').replace('<div id="root">', `${sheets.join('')}<div id="root">`)
      },
    },
  }
}
