/** How a page's charts are looked at, kept in its address, so that a link and a reload show the same. */
import { useCallback, useEffect, useMemo, useRef, useState } from 'react'
import { useSearchParams } from 'react-router'
import { type Across, isAcross } from './across'
import { panelsOf } from './panels'

export interface ChartView {
  across: Across
  /** Whether x is logarithmic, in all charts. */
  logX: boolean
  /** The charts whose y is. */
  logY: readonly string[]
  /** The metrics that are looked at, in order; null for what is usual. */
  panels: readonly string[] | null
}

/** What stands in the address only where it is another. */
const USUAL: ChartView = { across: 'steps', logX: false, logY: [], panels: null }
const ON = '1'
/** More charts than a page has. */
const MOST_NAMES = 60

export function readView(search: URLSearchParams): ChartView {
  const across = search.get('x')
  return {
    across: isAcross(across) ? across : USUAL.across,
    logX: search.get('xlog') === ON,
    logY: [...new Set(search.getAll('ylog'))].slice(0, MOST_NAMES),
    panels: panelsOf(search.getAll('panel')),
  }
}

/** The address's query with a view in it; all else stays. */
export function writtenView(before: URLSearchParams, view: ChartView): URLSearchParams {
  const after = new URLSearchParams(before)
  for (const name of ['x', 'xlog', 'ylog', 'panel']) after.delete(name)
  if (view.across !== USUAL.across) after.set('x', view.across)
  if (view.logX) after.set('xlog', ON)
  for (const name of view.logY) after.append('ylog', name)
  for (const name of view.panels ?? []) after.append('panel', name)
  return after
}

export type ChangeView = (change: Partial<ChartView>) => void

/** The view in the address, and what changes it: told at once, while the address follows when all charts are drawn. */
export function useChartView(): [ChartView, ChangeView] {
  const [search, setSearch] = useSearchParams()
  const [asked, setAsked] = useState<ChartView | null>(null)
  const kept = useMemo(() => readView(search), [search])
  // biome-ignore lint/correctness/useExhaustiveDependencies: another address is what was asked for, or what overrules it.
  useEffect(() => setAsked(null), [search])
  const view = asked ?? kept
  const newest = useRef(view)
  newest.current = view
  const change = useCallback(
    (part: Partial<ChartView>) => {
      newest.current = { ...newest.current, ...part }
      setAsked(newest.current)
      setSearch((before) => writtenView(before, newest.current), { replace: true, preventScrollReset: true })
    },
    [setSearch],
  )
  return [view, change]
}

/** Whether a chart's y is logarithmic, and what changes it. */
export interface LogSwitch {
  on: boolean
  set: (on: boolean) => void
}

export function logOf({ logY }: ChartView, change: ChangeView, name: string): LogSwitch {
  const others = logY.filter((one) => one !== name)
  return { on: others.length < logY.length, set: (on) => change({ logY: on ? [...others, name] : others }) }
}

/** What charts that share their zoom have in common: with another one they show all of x again. */
export const sharedX = ({ across, logX }: ChartView): string => (logX ? `${across}, logarithmic` : across)
