/** A part of a page that begins below what is seen: made when one comes near, or when there is time. */
import { type ReactNode, useRef } from 'react'
import { useNear } from '../lib/near'

interface BelowProps {
  /** Pixels that are kept free for it. */
  height: number
  /** Made at once: the address asks for something in it. */
  now?: boolean
  /** Made only when one comes near. */
  waits?: boolean
  children: ReactNode
}

export function Below({ height, now = false, waits = false, children }: BelowProps) {
  const place = useRef<HTMLDivElement>(null)
  const near = useNear(place, waits)
  return near || now ? children : <div ref={place} style={{ height }} />
}
