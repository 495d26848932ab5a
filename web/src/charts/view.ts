/** How a page's charts are looked at, kept in its address, so that a link and a reload show the same. */
import { useCallback } from 'react'
import { useSearchParams } from 'react-router'
import { type Across, isAcross } from './across'

export interface ChartView {
  across: Across
}

/** What stands in the address only where it is another. */
const USUAL: ChartView = { across: 'steps' }

export function readView(search: URLSearchParams): ChartView {
  const across = search.get('x')
  return { across: isAcross(across) ? across : USUAL.across }
}

/** The address's query with a view in it; all else stays. */
export function writtenView(before: URLSearchParams, view: ChartView): URLSearchParams {
  const after = new URLSearchParams(before)
  after.delete('x')
  if (view.across !== USUAL.across) after.set('x', view.across)
  return after
}

export function useChartView(): [ChartView, (change: Partial<ChartView>) => void] {
  const [search, setSearch] = useSearchParams()
  const change = useCallback(
    (part: Partial<ChartView>) =>
      setSearch((before) => writtenView(before, { ...readView(before), ...part }), {
        replace: true,
        preventScrollReset: true,
      }),
    [setSearch],
  )
  return [readView(search), change]
}
