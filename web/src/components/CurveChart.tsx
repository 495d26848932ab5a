/** A metric of one or more experiments: seeds thin, means bold, intervals as bands. */
import { keepPreviousData } from '@tanstack/react-query'
import { memo, useMemo } from 'react'
import { $api } from '../api/client'
import type { Curves } from '../api/types'
import { ACROSS, isTime } from '../charts/across'
import { useComparedCurves } from '../charts/following'
import { MetricChart } from '../charts/MetricChart'
import { lookOf } from '../charts/panels'
import { chartOfCurves } from '../charts/shape'
import { type ChangeView, type ChartView, hiddenOf, logOf, smoothOfChart } from '../charts/view'
import { plural } from '../lib/format'

const POINTS = 400
/** Single seeds, of all experiments together: more lines are a blur, and slow. */
const LINES = 100

interface CurveChartProps {
  /** Of the metric. */
  name: string
  experiments: readonly string[]
  view: ChartView
  onView: ChangeView
}

export const CurveChart = memo(function CurveChart({ name, experiments, view, onView }: CurveChartProps) {
  const { across, logX } = view
  const query = {
    ...{ experiment: [...experiments], name, points: POINTS, lines: LINES },
    ...(across === 'steps' ? {} : { x: across }),
    ...(logX ? { log: true } : {}),
  }
  const { data, error } = useComparedCurves(query, keepPreviousData)
  const chart = useMemo(() => (data ? chartOfCurves(data) : { x: [], lines: [] }), [data])
  return (
    <MetricChart
      {...lookOf(name)}
      data={chart}
      x={ACROSS[data?.across ?? across]}
      logX={logX}
      log={logOf(view, onView, name)}
      smooth={smoothOfChart(view, onView, name)}
      lines={hiddenOf(view, onView)}
      foot={data ? gridOf(data) : null}
      empty={error && !data ? 'Could not be loaded' : data ? (leftOut(data) ?? 'No value yet') : ''}
    />
  )
})

/** On what the means are taken, where that is not simply every step that was reported; null where it is. */
function gridOf(curves: Curves): string | null {
  const { across, spacing, steps, x } = curves
  const places = (x ?? steps).length
  if (places === 0 || (across === 'steps' && spacing === 'points')) return null
  const grid = GRIDS[spacing](plural(places, isTime(across) ? 'time' : across === 'steps' ? 'step' : 'count'))
  const ends = across === 'steps' ? 'a seed' : 'until the first seed is through; each'
  return [`${grid}, ${ends} interpolated between its own points`, leftOut(curves)].filter(Boolean).join('. ')
}

const GRIDS: Record<Curves['spacing'], (places: string) => string> = {
  points: (places) => `Means at the ${places} of all points`,
  even: (places) => `Means at ${places} evenly spaced`,
  logarithmic: (places) => `Means at ${places} spaced by equal factors`,
}

/** Runs of which it is not known where they lie; null where there is none. */
function leftOut({ across, experiments }: Curves): string | null {
  const runs = experiments.reduce((sum, { unplaced }) => sum + unplaced, 0)
  if (runs === 0) return null
  return `${plural(runs, 'run')} left out: ${ACROSS[across].label} was not counted when ${runs === 1 ? 'it' : 'they'} trained`
}

/** The metrics that the runs of these experiments have reported, as far as it is told. */
export function useReported(experiments: readonly string[]): readonly string[] {
  const { data } = $api.useQuery(
    'get',
    '/api/compare/metrics',
    { params: { query: { experiment: [...experiments] } } },
    { placeholderData: keepPreviousData },
  )
  return useMemo(() => (data?.metrics ?? []).map(({ name }) => name), [data])
}
