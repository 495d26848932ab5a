/**
 * What lies far below what is seen is made when one comes near; most of it also when the browser has nothing else to do. One by one,
 * each in a turn of its own: between two of them the page answers.
 */
import { type RefObject, startTransition, useEffect, useRef, useState } from 'react'

/** How far beyond the window is near. */
const MARGIN = '600px'
/** After the page's own beginning. */
const FIRST_MS = 150

type Show = () => void

/** Those that wait are shown one after the other; `turn` comes for the next one. */
function inTurn(turn: (showNext: Show, first: boolean) => void) {
  const waiting = new Set<Show>()
  let coming = false
  const come = (first: boolean) => {
    if (coming || waiting.size === 0) return
    coming = true
    turn(() => {
      coming = false
      const [next] = waiting
      if (next) waiting.delete(next)
      next?.()
      come(false)
    }, first)
  }
  return {
    add(show: Show) {
      waiting.add(show)
      come(true)
    },
    remove: (show: Show) => waiting.delete(show),
  }
}

const soon = inTurn((showNext) => setTimeout(showNext))
const whenIdle = inTurn((showNext, first) =>
  setTimeout(
    () => ('requestIdleCallback' in window ? window.requestIdleCallback(showNext) : showNext()),
    first ? FIRST_MS : 0,
  ),
)

/** Without it nothing is known of what is seen: all of it may be. */
const knowsSight = () => 'IntersectionObserver' in window

/** Whether `ref` is, or once was, near what is seen, or there was time for it; with `waits` there never is. */
export function useNear(ref: RefObject<Element | null>, waits = false): boolean {
  const [near, setNear] = useState(!knowsSight())
  useEffect(() => {
    const element = ref.current
    if (near || !element) return
    const show = () => startTransition(() => setNear(true))
    const observer = new IntersectionObserver(
      (entries) => entries.some(({ isIntersecting }) => isIntersecting) && soon.add(show),
      { rootMargin: MARGIN },
    )
    observer.observe(element)
    if (!waits) whenIdle.add(show)
    return () => {
      observer.disconnect()
      soon.remove(show)
      whenIdle.remove(show)
    }
  }, [near, ref, waits])
  return near
}

/** How many of `total` parts there are by now: one more in each turn. */
export function useOneByOne(total: number): number {
  const [made, setMade] = useState(knowsSight() ? 1 : Number.POSITIVE_INFINITY)
  useEffect(() => {
    if (made >= total) return
    const show = () => startTransition(() => setMade(made + 1))
    soon.add(show)
    return () => void soon.remove(show)
  }, [made, total])
  return Math.min(made, total)
}

/** How far beyond the window something is drawn anew: so that it is new when it is scrolled to. */
const DRAWN_MARGIN = '150px'

/** Whether `ref` may be seen now, as long as it is there; `enter` is called when it comes into sight. */
export function useInSight(ref: RefObject<Element | null>, enter: () => void): RefObject<boolean> {
  const inSight = useRef(true)
  const entered = useRef(enter)
  entered.current = enter
  useEffect(() => {
    const element = ref.current
    if (!element || !('IntersectionObserver' in window)) return
    const observer = new IntersectionObserver(
      (entries) => {
        const seen = entries.at(-1)?.isIntersecting ?? true
        const before = inSight.current
        inSight.current = seen
        if (seen && !before) entered.current()
      },
      { rootMargin: DRAWN_MARGIN },
    )
    observer.observe(element)
    return () => {
      observer.disconnect()
      inSight.current = true
    }
  }, [ref])
  return inSight
}
