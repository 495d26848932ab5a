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
  /** What they show of x where somebody keeps it; else they keep it themselves. */
  kept?: { range: XRange | null; zoomTo: (range: XRange | null) => void }
  children: ReactNode
}

export function LinkedCharts({ of, kept, children }: LinkedChartsProps) {
  const key = useId()
  const [own, zoomOwn] = useState<XRange | null>(null)
  const { range, zoomTo } = kept ?? { range: own, zoomTo: zoomOwn }
  const [shown, setShown] = useState(of)
  if (shown !== of) {
    setShown(of)
    zoomOwn(null)
  }
  const linked = useMemo(() => ({ key, range, zoomTo }), [key, range, zoomTo])
  return <Context.Provider value={linked}>{children}</Context.Provider>
}

/** The charts that one belongs to; null for a chart of its own. */
export function useLinkedCharts(): Linked | null {
  return useContext(Context)
}
