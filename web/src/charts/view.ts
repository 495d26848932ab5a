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
  /** How much of the past is in each chart's curves, by the chart's name; charts that are not smoothed are not there. */
  smooth: Readonly<Record<string, number>>
  /** The lines that are hidden in all charts, by their keys: ids of experiments, names of metrics. */
  hidden: readonly string[]
  /** What is shown of x; null for all of it. */
  zoom: readonly [number, number] | null
}

/** What stands in the address only where it is another. */
const USUAL: ChartView = {
  across: 'steps',
  logX: false,
  logY: [],
  panels: null,
  smooth: {},
  hidden: [],
  zoom: null,
}
const ON = '1'
/** More charts than a page has. */
const MOST_NAMES = 60
const LONGEST_NAME = 80
/** Between a chart's smoothing and its name, and between the ends of a zoom. */
const BETWEEN = '~'
export const MOST_SMOOTHING = 0.99

export function readView(search: URLSearchParams): ChartView {
  const across = search.get('x')
  return {
    across: isAcross(across) ? across : USUAL.across,
    logX: search.get('xlog') === ON,
    logY: [...new Set(search.getAll('ylog'))].slice(0, MOST_NAMES),
    panels: panelsOf(search.getAll('panel')),
    smooth: smoothOf(search.getAll('smooth')),
    hidden: [...new Set(search.getAll('hide'))]
      .filter((key) => key.length <= LONGEST_NAME)
      .slice(0, MOST_NAMES),
    zoom: zoomOf(search.get('zoom')),
  }
}

function smoothOf(texts: readonly string[]): Record<string, number> {
  const found = texts.slice(0, MOST_NAMES).flatMap((text): [string, number][] => {
    const [strength = '', ...name] = text.split(BETWEEN)
    const value = Number(strength)
    return value > 0 && value <= MOST_SMOOTHING ? [[name.join(BETWEEN), value]] : []
  })
  return Object.fromEntries(found)
}

function zoomOf(text: string | null): [number, number] | null {
  const [from = Number.NaN, to = Number.NaN, ...more] = (text ?? '').split(BETWEEN).map(Number)
  return more.length === 0 && Number.isFinite(from) && Number.isFinite(to) && from < to ? [from, to] : null
}

/** How much a chart is smoothed, as it stands in an address. */
export const smoothText = (name: string, strength: number): string => `${strength}${BETWEEN}${name}`

/** What is shown of x, likewise. */
export const zoomText = (zoom: readonly [number, number]): string =>
  zoom.map((end) => Number(end.toPrecision(6))).join(BETWEEN)

/** The address's query with a view in it; all else stays. */
export function writtenView(before: URLSearchParams, view: ChartView): URLSearchParams {
  const after = new URLSearchParams(before)
  for (const name of ['x', 'xlog', 'ylog', 'panel', 'smooth', 'hide', 'zoom']) after.delete(name)
  if (view.across !== USUAL.across) after.set('x', view.across)
  if (view.logX) after.set('xlog', ON)
  for (const name of view.logY) after.append('ylog', name)
  for (const name of view.panels ?? []) after.append('panel', name)
  for (const [name, strength] of Object.entries(view.smooth))
    after.append('smooth', smoothText(name, strength))
  for (const key of view.hidden) after.append('hide', key)
  if (view.zoom) after.set('zoom', zoomText(view.zoom))
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
      // A zoom is of what x was.
      if ('across' in part || 'logX' in part) newest.current = { ...newest.current, zoom: null }
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

/** How much a chart is smoothed, and what changes it. */
export interface SmoothSwitch {
  strength: number
  set: (strength: number) => void
}

export function smoothOfChart({ smooth }: ChartView, change: ChangeView, name: string): SmoothSwitch {
  const { [name]: strength = 0, ...others } = smooth
  return {
    strength,
    set: (next) => change({ smooth: next > 0 ? { ...others, [name]: next } : others }),
  }
}

/** Which lines are hidden, and what changes that. */
export interface HiddenLines {
  keys: readonly string[]
  set: (keys: readonly string[]) => void
}

export const hiddenOf = ({ hidden }: ChartView, change: ChangeView): HiddenLines => ({
  keys: hidden,
  set: (keys) => change({ hidden: keys }),
})

/** The zoom of charts that share it, kept in the address. */
export const useKeptZoom = ({ zoom }: ChartView, change: ChangeView) =>
  useMemo(
    () => ({ range: zoom, zoomTo: (next: ChartView['zoom']) => change({ zoom: next }) }),
    [zoom, change],
  )

/** What charts that share their zoom have in common: with another one they show all of x again. */
export const sharedX = ({ across, logX }: ChartView): string => (logX ? `${across}, logarithmic` : across)
