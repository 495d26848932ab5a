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

// A page that is called what the API says is told its name at once; the application takes the same answer (src/lib/early.ts).
document.addEventListener('DOMContentLoaded', async () => {
  const heading = document.querySelector('#frame [data-asks]')
  if (!heading) return
  const question = heading.dataset.asks + location.pathname.split('/').pop()
  const early = {
    page: location.pathname,
    question: new URL(question, location.href).href,
    answer: fetch(question),
    title: undefined,
    about: undefined,
  }
  window.maplessEarly = early
  const answer = await early.answer.catch(() => undefined)
  if (!answer?.ok) return
  const told = await answer.clone().json()
  const [title, about] = [...document.querySelectorAll('#frame [data-told]')].map((element) => {
    element.textContent = element.dataset.told.replace(/{(\w+)}/g, (_, name) => told[name])
    return element.textContent
  })
  Object.assign(early, { title, about })
})

// The application's code is asked for, and started, once the frame's first picture is seen, which in a tab in the background
// never is: it would take the line and the processor from that picture.
const { entry } = document.currentScript.dataset
if (entry) {
  document.addEventListener('DOMContentLoaded', () => {
    let patience = setTimeout(start, 300)
    if (PerformanceObserver.supportedEntryTypes?.includes('paint'))
      new PerformanceObserver(start).observe({ type: 'paint', buffered: true })
    else requestAnimationFrame(() => setTimeout(start))
    function start() {
      if (patience === undefined) return
      clearTimeout(patience)
      patience = undefined
      document.head.append(document.getElementById('code').content)
      import(entry)
    }
  })
}
