// Sets the colour scheme before the first paint, so that a dark page never flashes white. A file of its own
// because the content security policy allows no inline script.
const prefersDark = matchMedia('(prefers-color-scheme: dark)').matches
let chosen = null
try {
  chosen = localStorage.getItem('mantine-color-scheme-value')
} catch {
  // Storage may be forbidden: then the system's preference counts.
}
const dark = chosen === 'dark' || (chosen !== 'light' && prefersDark)
document.documentElement.setAttribute('data-mantine-color-scheme', dark ? 'dark' : 'light')
