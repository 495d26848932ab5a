/** The header as the build writes it into every HTML (plugins/pages), and as the application draws it (components/Shell). */
import { type Head, type Name, partsOf } from './heads'

/** What the header leads to; where room is short, only what comes before the stroke is said. */
export const NAVIGATION = [
  ['/', 'Trainings'],
  ['/new', 'New| training'],
  ['/studies', 'Studies'],
  ['/compare', 'Compare'],
  ['/evaluations', 'Eval|uations'],
  ['/policies', 'Policies'],
  ['/arenas', 'Arenas'],
  ['/playground', 'Play'],
  ['/reproduction', 'Paper'],
  ['/queue', 'Queue'],
] as const

/** Paths of icons, 24 by 24: of Tabler Icons, as `components/icons` has them. */
export const BELL = [
  'M10 5a2 2 0 1 1 4 0a7 7 0 0 1 4 6v3a4 4 0 0 0 2 3h-16a4 4 0 0 0 2 -3v-3a7 7 0 0 1 4 -6',
  'M9 17v1a3 3 0 0 0 6 0v-1',
]
export const MOON = ['M12 3c.132 0 .263 0 .393 0a7.5 7.5 0 0 0 7.92 12.446a9 9 0 1 1 -8.313 -12.454l0 .008']
export const SUN = [
  'M8 12a4 4 0 1 0 8 0a4 4 0 1 0 -8 0',
  'M3 12h1m8 -9v1m8 8h1m-9 8v1m-6.4 -15.4l.7 .7m12.1 -.7l-.7 .7m0 11.4l.7 .7m-12.1 -.7l-.7 .7',
]

const icon = (paths: readonly string[]) =>
  `<svg viewBox="0 0 24 24" aria-hidden="true">${paths.map((d) => `<path d="${d}"/>`).join('')}</svg>`

const escaped = (text: string) => text.replace(/&/g, '&amp;').replace(/</g, '&lt;')

const page = (html: string) =>
  `<main class="frame-page"><div class="frame-top"><div class="frame-text">${html}</div></div></main>`

const aboveHtml = ([above, to]: Name['within']) => `<p class="frame-above"><a href="${to}">${above}</a></p>`

/** A page's title and introduction, as `components/Page` draws them. */
function headHtml({ title, about, within }: Head): string {
  const said = partsOf(about ?? '').map(({ text, to, code }) => {
    if (code) return `<code>${escaped(text)}</code>`
    return to ? `<a href="${to}">${escaped(text)}</a>` : escaped(text)
  })
  return page(
    `${within ? aboveHtml(within) : ''}<h1>${escaped(title)}</h1>${about ? `<p class="frame-about">${said.join('')}</p>` : ''}`,
  )
}

/** The place of a title that `question` is asked for, and what the page is one of. */
function nameHtml({ title, about, within }: Name, question: string): string {
  return page(
    `${aboveHtml(within)}<h1 data-asks="${question.replace(/{.*/, '')}" data-told="${title}"></h1>` +
      (about ? `<p class="frame-about" data-told="${about}"></p>` : ''),
  )
}

/**
 * The header at the address `path`: its links lead, and its switch of the colour scheme works (public/frame.js). Below it
 * the head of the page, where that is known, or where the page's name will stand.
 */
export function frameHtml(path: string, head?: Head, named?: { name: Name; question: string }): string {
  const links = NAVIGATION.map(([to, label]) => {
    const [short, rest] = label.split('|')
    const current = to === path ? ' aria-current="page"' : ''
    return `<a href="${to}"${current}>${short}${rest ? `<span class="frame-wide">${rest}</span>` : ''}</a>`
  })
  return [
    '<div id="frame"><header class="frame-header">',
    '<a href="/" class="frame-name" aria-label="Mapless, home">',
    '<img src="/favicon.svg" alt="" width="22" height="22"><span>Mapless</span></a>',
    `<nav aria-label="Main" class="frame-nav">${links.join('')}</nav>`,
    '<div class="frame-tools">',
    `<a href="/alerts" class="frame-icon" aria-label="Alerts" title="Alerts">${icon(BELL)}</a>`,
    `<button type="button" class="frame-icon" data-scheme="dark" aria-label="Dark colours">${icon(MOON)}</button>`,
    `<button type="button" class="frame-icon" data-scheme="light" aria-label="Light colours">${icon(SUN)}</button>`,
    `</div></header>${head ? headHtml(head) : named ? nameHtml(named.name, named.question) : ''}</div>`,
  ].join('')
}
