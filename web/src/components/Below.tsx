/** A part of a page that begins below what is seen: made when one comes near, or when there is time. */
import { Children, type ReactNode, type Ref, useRef } from 'react'
import { useNear, useOneByOne } from '../lib/near'

interface BelowProps {
  /** Pixels that are kept free for it. */
  height: number
  /** What keeps them: an item within a list. */
  as?: 'div' | 'li'
  /** Made at once: the address asks for something in it. */
  now?: boolean
  /** Made only when one comes near. */
  waits?: boolean
  /** Made one after the other, from above. */
  children: ReactNode
}

export function Below({ height, as = 'div', now = false, waits = false, children }: BelowProps) {
  const place = useRef<HTMLElement>(null)
  const near = useNear(place, waits)
  if (near || now) return <Parts {...{ height, as, now }}>{children}</Parts>
  return <Room ref={place} {...{ height, as }} />
}

function Parts({
  height,
  as,
  now,
  children,
}: Required<Pick<BelowProps, 'height' | 'as' | 'now' | 'children'>>) {
  const parts = Children.toArray(children)
  const made = useOneByOne(parts.length)
  if (now || made === parts.length) return parts
  return [...parts.slice(0, made), <Room key="others" height={height * (1 - made / parts.length)} as={as} />]
}

function Room({
  ref,
  height,
  as: Place,
}: Required<Pick<BelowProps, 'height' | 'as'>> & { ref?: Ref<HTMLElement> }) {
  return <Place ref={ref as Ref<never>} style={{ height, listStyle: 'none' }} />
}
