/** What jsdom lacks of a browser, and matchers. */
import '@testing-library/jest-dom/vitest'
import { cleanup, configure } from '@testing-library/react'
import { afterEach, vi } from 'vitest'

// A test waits for what it expects, on a busy machine too.
configure({ asyncUtilTimeout: 20_000 })

afterEach(() => {
  cleanup()
  window.localStorage.clear()
  window.sessionStorage.clear()
})

window.matchMedia = (query) => ({
  matches: false,
  media: query,
  onchange: null,
  addEventListener: () => {},
  removeEventListener: () => {},
  addListener: () => {},
  removeListener: () => {},
  dispatchEvent: () => false,
})

class NoObserver {
  observe() {}
  unobserve() {}
  disconnect() {}
}
vi.stubGlobal('ResizeObserver', NoObserver)
// What scrolls draws only what is in sight.
Object.defineProperty(Element.prototype, 'clientHeight', { configurable: true, get: () => 800 })
Object.defineProperty(Element.prototype, 'clientWidth', { configurable: true, get: () => 1200 })
Element.prototype.scrollIntoView = () => {}

// uPlot draws on a canvas; what it draws is looked at in a real browser, not here.
const context = new Proxy({} as Record<string | symbol, unknown>, {
  get: (target, key) => (key in target ? target[key] : () => ({ width: 0 })),
  set: (target, key, value) => {
    target[key] = value
    return true
  },
})
HTMLCanvasElement.prototype.getContext = (() => context) as never
vi.stubGlobal(
  'Path2D',
  class {
    moveTo() {}
    lineTo() {}
    rect() {}
    arc() {}
    closePath() {}
    addPath() {}
    bezierCurveTo() {}
  },
)
