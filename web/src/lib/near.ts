/** What lies far below what is seen is made when one comes near; most of it also when the browser has nothing else to do, one by one. */
import { type RefObject, startTransition, useEffect, useRef, useState } from 'react'

/** How far beyond the window is near. */
const MARGIN = '600px'
/** After the page's own beginning. */
const FIRST_MS = 150

const waiting = new Set<() => void>()
let coming = false

/** Shows one of those that wait, and comes again. */
function showOne(): void {
  coming = false
  const [first] = waiting
  if (!first) return
  first()
  waiting.delete(first)
  later(0)
}

function later(ms: number): void {
  if (coming) return
  coming = true
  setTimeout(() => ('requestIdleCallback' in window ? window.requestIdleCallback(showOne) : showOne()), ms)
}

/** Whether `ref` is, or once was, near what is seen, or there was time for it; with `waits` there never is. */
export function useNear(ref: RefObject<Element | null>, waits = false): boolean {
  const [near, setNear] = useState(!('IntersectionObserver' in window))
  useEffect(() => {
    const element = ref.current
    if (near || !element) return
    const show = () => startTransition(() => setNear(true))
    const observer = new IntersectionObserver(
      (entries) => entries.some(({ isIntersecting }) => isIntersecting) && show(),
      { rootMargin: MARGIN },
    )
    observer.observe(element)
    if (!waits) {
      waiting.add(show)
      later(FIRST_MS)
    }
    return () => {
      observer.disconnect()
      waiting.delete(show)
    }
  }, [near, ref, waits])
  return near
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
