/** Charts that share their cursor and their zoom in x. */
import { createContext, type ReactNode, useContext, useId, useMemo, useState } from 'react'

export type XRange = readonly [number, number]

interface Linked {
  /** What their plots know one another by. */
  key: string
  /** What they all show of x; null for all of it. */
  range: XRange | null
  zoomTo: (range: XRange | null) => void
}

const Context = createContext<Linked | null>(null)

interface LinkedChartsProps {
  /** What their x is: with another one they show all of it again. */
  of?: string
  children: ReactNode
}

export function LinkedCharts({ of, children }: LinkedChartsProps) {
  const key = useId()
  const [range, zoomTo] = useState<XRange | null>(null)
  const [shown, setShown] = useState(of)
  if (shown !== of) {
    setShown(of)
    zoomTo(null)
  }
  const linked = useMemo(() => ({ key, range, zoomTo }), [key, range])
  return <Context.Provider value={linked}>{children}</Context.Provider>
}

/** The charts that one belongs to; null for a chart of its own. */
export function useLinkedCharts(): Linked | null {
  return useContext(Context)
}
