/** A part of a page that begins below what is seen: made when one comes near, or when there is time. */
import { type ReactNode, type Ref, useRef } from 'react'
import { useNear } from '../lib/near'

interface BelowProps {
  /** Pixels that are kept free for it. */
  height: number
  /** What keeps them: an item within a list. */
  as?: 'div' | 'li'
  /** Made at once: the address asks for something in it. */
  now?: boolean
  /** Made only when one comes near. */
  waits?: boolean
  children: ReactNode
}

export function Below({ height, as: Place = 'div', now = false, waits = false, children }: BelowProps) {
  const place = useRef<HTMLElement>(null)
  const near = useNear(place, waits)
  return near || now ? children : <Place ref={place as Ref<never>} style={{ height, listStyle: 'none' }} />
}
