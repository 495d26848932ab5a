/** From a study to the axes and points of its charts. */
import { type Axis, choices, numbers } from '../../charts/axis'
import type { Point } from '../../charts/Scatter'
import { labelsOf } from '../../form/labels'
import type { Json, Schema } from '../../form/schema'
import { settingText } from '../../form/settingText'
import { namedPath, sameValue } from '../../form/values'
import { count, duration, percent, significant } from '../../lib/format'
import type { SearchedSetting, Study, Trial } from './study'

const [ORDINARY, BEST] = [0, 1]

/** Above so much, the axis begins at a tenth below the worst: what is between 90 and 98 % would be a flat row. */
const HIGH = 0.5

type Measured = Trial & { success: number }

/** Of the success rates of all trials that have one, those that were stopped early included. */
export function successAxis(study: Study): Axis {
  const least = Math.min(1, ...measured(study).map(({ success }) => success))
  const from = least > HIGH ? Math.ceil(least * 10 - 1) / 10 : 0
  return numbers([from, 1], (share) => percent(share), { from, to: 1 })
}

/** The trials that have a success rate: the complete ones. */
export const complete = (study: Study): Measured[] =>
  study.results.filter((trial): trial is Measured => trial.success !== null)

/** These, and those that were stopped early, with what was measured of them last, in the order of their numbers. */
export function measured(study: Study): Measured[] {
  return study.results.flatMap((trial) => {
    const last = Object.keys(trial.rungs).length ? trial.rungs[lastRung(trial)] : undefined
    const success = trial.success ?? (trial.state === 'pruned' ? last : undefined)
    return success === undefined ? [] : [{ ...trial, success }]
  })
}

const lastRung = (trial: Trial): number => Math.max(...Object.keys(trial.rungs).map(Number))

/** The axis of a searched setting: all that it may be. */
export function settingAxis(setting: SearchedSetting): Axis {
  return setting.kind === 'list'
    ? choices(setting.values, settingText)
    : numbers([setting.low, setting.high], (value) => significant(value, 3), { log: setting.log ?? false })
}

/** What a setting is called: "Learning rate"; with its heading where two are called alike, or it is a reward's term's. */
export function settingTitles(
  settings: readonly SearchedSetting[],
  schema: Schema | undefined,
  training: unknown,
): string[] {
  const paths = settings.map(({ path }) => path.split('.'))
  const named = paths.map((path) => namedPath(training as Json, path))
  const labels = named.map((path) => (schema ? labelsOf(schema, ['training', ...path]) : path))
  return labels.map((label, index) => {
    const last = label.at(-1) ?? ''
    if (!sameValue(paths[index], named[index])) return `${label.at(-2)}, ${last.toLowerCase()}`
    const alike = labels.some((other, at) => at !== index && other.at(-1) === last)
    return alike ? label.slice(-2).join(', ') : last
  })
}

/** A trial in a line, for who points at it. */
export function titleOf(
  trial: Trial,
  settings: readonly SearchedSetting[],
  titles: readonly string[],
): string {
  const values = settings.map(({ path }, index) => `${titles[index]} ${settingText(trial.values[path])}`)
  const success = trial.success === null ? '' : `: ${percent(trial.success)}`
  const early = trial.state === 'pruned' ? `, stopped early after ${count(lastRung(trial))} steps` : ''
  return `Trial ${trial.number}${success}${early}\n${values.join('\n')}`
}

interface Named {
  study: Study
  titles: readonly string[]
}

function point({ study, titles }: Named, trial: Trial, x: unknown, y: unknown): Point {
  const best = trial.number === study.best
  return {
    key: String(trial.number),
    x,
    y,
    color: trial.state === 'pruned' ? null : best ? BEST : ORDINARY,
    large: best,
    title: titleOf(trial, study.spec.settings, titles),
  }
}

/** Success by number, and the best complete one until then. */
export function history(named: Named): { points: Point[]; line: [number, number][] } {
  let best = Number.NEGATIVE_INFINITY
  const line: [number, number][] = []
  const points = measured(named.study).map((trial) => {
    if (trial.state !== 'pruned') best = Math.max(best, trial.success)
    if (best >= 0) line.push([trial.number, best])
    return point(named, trial, trial.number, trial.success)
  })
  return { points, line }
}

/** Success over the values of one setting. */
export const slice = (named: Named, path: string): Point[] =>
  measured(named.study).map((trial) => point(named, trial, trial.values[path], trial.success))

/** Success over cost, and the trials that no other one beats in both. */
export function front(named: Named): { points: Point[]; line: [number, number][]; axis: Axis } {
  const trials = complete(named.study).flatMap((trial) =>
    trial.cost === null ? [] : [{ ...trial, cost: trial.cost }],
  )
  const unbeaten = named.study.front.flatMap(
    (number) => trials.find((trial) => trial.number === number) ?? [],
  )
  return {
    points: trials.map((trial) => point(named, trial, trial.cost, trial.success)),
    line: unbeaten.map((trial) => [trial.cost, trial.success]),
    axis: numbers(
      trials.map((trial) => trial.cost),
      duration,
    ),
  }
}

/** How good each trial is among all, 0 to 1. */
export function merits(study: Study): Map<number, number> {
  const rates = complete(study).map((trial) => trial.success)
  const [low, high] = [Math.min(...rates), Math.max(...rates)]
  return new Map(
    complete(study).map((trial) => [trial.number, high > low ? (trial.success - low) / (high - low) : 1]),
  )
}
