/** From the API's answers to the charts' lines. */
import type { Curves, Profiles, Series } from '../api/types'
import { plural } from '../lib/format'
import type { ChartSpec } from './metrics'
import { type Look, looksOf } from './palette'
import { alignSeries, type ChartData, type Line } from './series'

/**
 * The series that a chart shows, on one x; a series without points is left out. Behind one whose points were taken together
 * lies the band of their smallest and largest values.
 */
export function chartOf(spec: ChartSpec, series: readonly Series[]): ChartData {
  const found = metricsOf(spec, series).flatMap((metric, color) => {
    const one = series.find((candidate) => candidate.name === metric.name)
    return one && one.steps.length > 0 ? [{ ...metric, color, series: one }] : []
  })
  const { x, values } = alignSeries(found.map((one) => one.series))
  const edges = (edge: 'min' | 'max') =>
    alignSeries(found.map(({ series: { steps, ...one } }) => ({ steps, values: one[edge] ?? one.values })))
      .values
  const low = edges('min')
  const high = edges('max')
  const lines = found.map(
    ({ name, label, color, series: { min } }, index): Line => ({
      key: name,
      label,
      color,
      values: values[index] ?? [],
      ...(min === null ? {} : { band: { low: low[index] ?? [], high: high[index] ?? [] } }),
    }),
  )
  return { x, lines }
}

/** The metrics of a chart, those that it finds by their beginning in the order in which they came. */
function metricsOf({ metrics, prefix }: ChartSpec, series: readonly Series[]): ChartSpec['metrics'] {
  if (prefix === undefined) return metrics
  const found = series.filter(({ name }) => name.startsWith(prefix))
  return [
    ...metrics,
    ...found.map(({ name }) => ({ name, label: name.slice(prefix.length).replaceAll('_', ' ') })),
  ]
}

/**
 * Experiments together: each seed thin, the mean of the seeds bold, and its interval as a band. The legend counts the
 * seeds: how many stand behind the curve at its fullest. `look` names and colours the experiments where their own names
 * and ids should not.
 */
export function chartOfCurves(
  curves: Curves,
  look: (experiment: Curves['experiments'][number]) => { name: string } & Look = byId(curves.experiments),
): ChartData {
  const lines = curves.experiments.flatMap((experiment): Line[] => {
    const { name, color, dash } = look(experiment)
    const seeds = Math.max(0, ...experiment.count)
    if (seeds === 0) return []
    const single = seeds === 1
    const thin = single
      ? []
      : experiment.seeds.map(
          ({ seed, values }): Line => ({
            key: `${experiment.id}:${seed}`,
            name: `${name}, seed ${seed}`,
            ...{ color, dash, thin: true, values },
          }),
        )
    const drawn = thin.length > 0 && thin.length < seeds ? `, ${thin.length} drawn` : ''
    const mean: Line = {
      key: experiment.id,
      label: `${name}, ${plural(seeds, 'seed')}${drawn}`,
      color,
      dash,
      values: experiment.mean,
      ...untilOf(experiment, curves.x ?? curves.steps),
      ...(single ? {} : { band: { low: experiment.low, high: experiment.high } }),
    }
    return [...thin, mean]
  })
  return { x: lines.length > 0 ? (curves.x ?? curves.steps) : [], lines }
}

/** Where a mean ends before its last seed does, as it may over time; nothing where they end together. */
function untilOf({ mean, count }: Curves['experiments'][number], x: readonly number[]): { until?: number } {
  const last = mean.findLastIndex((value) => value !== null)
  const until = x[last]
  return until === undefined || last >= count.findLastIndex((seeds) => seeds > 0) ? {} : { until }
}

/** Experiments under their names, each in the look that stays with it. */
function byId(experiments: readonly { id: string; name: string }[]) {
  const looks = looksOf(experiments.map(({ id }) => id))
  return ({ id, name }: { id: string; name: string }): { name: string } & Look => ({
    name,
    ...(looks.get(id) ?? { color: 0, dash: 0 }),
  })
}

/** Performance profiles: the mean over seeds of each training with its interval; x is the score. */
export function chartOfProfiles({ thresholds, experiments }: Profiles): ChartData {
  const look = byId(experiments)
  const lines = experiments.flatMap(({ seeds, mean, low, high, ...one }): Line[] =>
    seeds === 0
      ? []
      : [
          {
            key: one.id,
            ...look(one),
            label: `${one.name}, ${plural(seeds, 'seed')}`,
            values: mean,
            ...(seeds > 1 ? { band: { low, high } } : {}),
          },
        ],
  )
  return { x: lines.length > 0 ? thresholds : [], lines }
}
