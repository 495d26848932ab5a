/** From the API's answers to the charts' lines. */
import type { Curves, Profiles, Series } from '../api/types'
import { plural } from '../lib/format'
import type { ChartSpec } from './metrics'
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
 * and their order should not.
 */
export function chartOfCurves(
  curves: Curves,
  look: (experiment: Curves['experiments'][number], index: number) => { name: string; color: number } = (
    { name },
    color,
  ) => ({ name, color }),
): ChartData {
  const lines = curves.experiments.flatMap((experiment, index): Line[] => {
    const { name, color } = look(experiment, index)
    const seeds = Math.max(0, ...experiment.count)
    if (seeds === 0) return []
    const single = seeds === 1
    const thin = single
      ? []
      : experiment.seeds.map(
          ({ seed, values }): Line => ({ key: `${experiment.id}:${seed}`, color, thin: true, values }),
        )
    const drawn = thin.length > 0 && thin.length < seeds ? `, ${thin.length} drawn` : ''
    const mean: Line = {
      key: experiment.id,
      label: `${name}, ${plural(seeds, 'seed')}${drawn}`,
      color,
      values: experiment.mean,
      ...(single ? {} : { band: { low: experiment.low, high: experiment.high } }),
    }
    return [...thin, mean]
  })
  return { x: lines.length > 0 ? (curves.x ?? curves.steps) : [], lines }
}

/** Performance profiles: the mean over seeds of each training with its interval; x is the score. */
export function chartOfProfiles({ thresholds, experiments }: Profiles): ChartData {
  const lines = experiments.flatMap(({ id, name, seeds, mean, low, high }, color): Line[] =>
    seeds === 0
      ? []
      : [
          {
            key: id,
            label: `${name}, ${plural(seeds, 'seed')}`,
            color,
            values: mean,
            ...(seeds > 1 ? { band: { low, high } } : {}),
          },
        ],
  )
  return { x: lines.length > 0 ? thresholds : [], lines }
}
