// What the frame in the HTML does before the application has come. A file of its own because the content security policy
// allows no inline script.
const KEY = 'mantine-color-scheme-value'
const root = document.documentElement

// The colour scheme is set before the first paint, so that a dark page never flashes white.
let chosen = null
try {
  chosen = localStorage.getItem(KEY)
} catch {
  // Storage may be forbidden: then the system's preference counts.
}
const dark = chosen === 'dark' || (chosen !== 'light' && matchMedia('(prefers-color-scheme: dark)').matches)
root.setAttribute('data-mantine-color-scheme', dark ? 'dark' : 'light')

// The application reads what was chosen meanwhile.
document.addEventListener('click', ({ target }) => {
  const scheme = target.closest('#frame [data-scheme]')?.dataset.scheme
  if (!scheme) return
  root.setAttribute('data-mantine-color-scheme', scheme)
  try {
    localStorage.setItem(KEY, scheme)
  } catch {
    // It holds for this page.
  }
})

const { entry, asks } = document.currentScript.dataset

// What the page asks of the server first goes out now, and not when all scripts have come (src/asks.ts, src/api/early.ts).
if (asks) {
  const PATIENCE_MS = 15_000
  const base = root.dataset.base ?? ''
  const parts = location.pathname.slice(base.length).split('/')
  const query = [...new URLSearchParams(location.search)]
  const experiments = query.every(([name]) => name === 'experiment') ? location.search.slice(1) : ''
  const pathOf = (ask) => {
    if (ask.includes('{experiments}')) return experiments && ask.replace('{experiments}', experiments)
    if (ask.includes('?') && location.search) return ''
    return ask.replace(/\{(\d)\}/g, (_, part) => parts[part])
  }
  const early = new Map()
  for (const path of asks.split(' ').map(pathOf)) {
    if (!path) continue
    const answer = fetch(base + path)
    // Whoever takes it hears of its failure.
    answer.catch(() => undefined)
    early.set(base + path, answer)
  }
  window.early = early
  setTimeout(() => {
    for (const answer of early.values()) answer.then(({ body }) => body?.cancel()).catch(() => undefined)
    early.clear()
  }, PATIENCE_MS)
}

// The application starts when the page is read and the frame's first picture drawn, which a tab in the background never is.
if (entry) {
  document.addEventListener('DOMContentLoaded', () => {
    const patience = setTimeout(start, 300)
    requestAnimationFrame(() => setTimeout(start))
    function start() {
      clearTimeout(patience)
      import(entry)
    }
  })
}
