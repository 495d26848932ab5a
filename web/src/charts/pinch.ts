/** Two fingers on a chart: what is between them stays between them, and x grows as they part. */

type Range = readonly [number, number]

/** Of a logarithmic axis the exponents. */
interface Axis {
  shown: () => Range
  /** All that there is to show. */
  all: () => Range
  /** Called for each move; null for all that there is. */
  show: (range: Range | null) => void
  /** The last finger but one is lifted. */
  end: (range: Range | null) => void
}

/**
 * The range that two fingers show of an axis.
 *
 * `from` is what was shown when they came down, `began` where they were then and `now` where they are, each as the middle
 * (share of the width) and the distance (pixels).
 */
export function pinched(
  from: Range,
  all: Range,
  began: { middle: number; apart: number },
  now: { middle: number; apart: number },
): Range | null {
  const span = ((from[1] - from[0]) * began.apart) / now.apart
  if (span >= all[1] - all[0]) return null
  const held = from[0] + (from[1] - from[0]) * began.middle
  const low = Math.min(Math.max(held - span * now.middle, all[0]), all[1] - span)
  return [low, low + span]
}

/** Lets two fingers zoom and pan; one scrolls the page as before. */
export function listenForPinch(element: HTMLElement, axis: Axis): void {
  let began: { from: Range; middle: number; apart: number } | null = null
  let last: Range | null | undefined

  const where = ({ touches }: TouchEvent) => {
    const [first, second] = [touches[0], touches[1]]
    if (!first || !second) return null
    const box = element.getBoundingClientRect()
    return {
      middle: ((first.clientX + second.clientX) / 2 - box.left) / box.width,
      apart: Math.max(1, Math.hypot(first.clientX - second.clientX, first.clientY - second.clientY)),
    }
  }
  const start = (event: TouchEvent) => {
    const fingers = where(event)
    if (!fingers) return
    event.preventDefault()
    began = { from: axis.shown(), ...fingers }
    last = undefined
  }
  const move = (event: TouchEvent) => {
    const fingers = where(event)
    if (!began || !fingers) return
    event.preventDefault()
    last = pinched(began.from, axis.all(), began, fingers)
    axis.show(last)
  }
  const end = (event: TouchEvent) => {
    if (!began || event.touches.length > 1) return
    began = null
    if (last !== undefined) axis.end(last)
  }
  // The page would scroll before a listener that may not refuse.
  element.addEventListener('touchstart', start, { passive: false })
  element.addEventListener('touchmove', move, { passive: false })
  element.addEventListener('touchend', end)
  element.addEventListener('touchcancel', end)
}
