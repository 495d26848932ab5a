/** What x of curves is: environment steps, or what a run counts beside them. */
import type { Series } from '../api/types'
import { count, duration, significant } from '../lib/format'
import { type Horizontal, STEPS } from './axis'

export type Across = 'steps' | 'wall' | 'cpu' | 'episodes'

interface AcrossLook extends Horizontal {
  /** In the control. */
  label: string
  /** The series that counts it; steps need none. */
  counter?: string
}

const MINUTE = 60
const HOUR = 60 * MINUTE
const DAY = 24 * HOUR
/** Seconds that are round as seconds, minutes, hours or days. */
const ROUND_TIMES = [
  ...[0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30],
  ...[1, 2, 5, 10, 15, 30].map((minutes) => minutes * MINUTE),
  ...[1, 2, 3, 6, 12].map((hours) => hours * HOUR),
  ...[1, 2, 5, 10, 20, 50, 100, 200, 500].map((days) => days * DAY),
]

export const ACROSS: Record<Across, AcrossLook> = {
  steps: { label: 'Steps', ...STEPS },
  wall: { ...time('Time under way'), label: 'Wall time', counter: 'time/wall_seconds' },
  cpu: { ...time('CPU time of the trainer'), label: 'CPU time', counter: 'time/cpu_seconds' },
  episodes: { label: 'Episodes', title: 'Episodes', format: count, counter: 'train/episodes' },
}

export const isAcross = (text: string | null): text is Across => text !== null && text in ACROSS

/** Whether x is in seconds. */
export const isTime = (across: Across): boolean => across === 'wall' || across === 'cpu'

/** Whether what x would be was counted, given all metrics that were reported; before any was, nobody knows. */
export function isCounted(reported: readonly string[], across: Across): boolean {
  const { counter } = ACROSS[across]
  return counter === undefined || reported.length === 0 || reported.includes(counter)
}

function time(title: string): Horizontal {
  return { title, column: `${title}, seconds`, format: elapsed, rounds: ROUND_TIMES }
}

/** Seconds from a training's start: "0.5 s", "45 s", "3 min 20 s". */
function elapsed(seconds: number): string {
  return seconds < 60 ? `${significant(seconds, 3)} s` : duration(seconds)
}

/**
 * The series with what was counted at their steps in place of these; null where the run has not counted it. Between two
 * reports of the counter it is linear, beyond the first and the last there is nothing; of points at one count the newest stands.
 */
export function placed(series: readonly Series[], across: Across): readonly Series[] | null {
  const { counter: name } = ACROSS[across]
  if (name === undefined) return series
  const counter = series.find((one) => one.name === name)
  if (!counter || counter.steps.length === 0) return null
  const counts = counter.max ?? counter.values
  return series.map((one) => onCounts(one, counter.steps, counts))
}

/** A counter never falls: of points that were taken together, its highest is the one at their last step. */
function onCounts(one: Series, steps: readonly number[], counts: readonly (number | null)[]): Series {
  const x: number[] = []
  const kept: number[] = []
  let after = 0
  one.steps.forEach((step, index) => {
    while (after < steps.length - 1 && (steps[after] ?? 0) < step) after++
    const at = between(step, after, steps, counts)
    if (at === null) return
    if (x.at(-1) === at) kept.pop()
    else x.push(at)
    kept.push(index)
  })
  const pick = (values: readonly (number | null)[]) => kept.map((index) => values[index] ?? null)
  return {
    name: one.name,
    steps: x,
    values: pick(one.values),
    min: one.min && pick(one.min),
    max: one.max && pick(one.max),
  }
}

/** The count at a step, of which `after` is the first report that is not before it; null where it is not known. */
function between(
  step: number,
  after: number,
  steps: readonly number[],
  counts: readonly (number | null)[],
): number | null {
  const next = steps[after]
  const high = counts[after] ?? null
  if (next === undefined || high === null || next < step) return null
  if (next === step) return high
  const last = steps[after - 1]
  const low = counts[after - 1] ?? null
  if (last === undefined || low === null) return null
  return low + ((step - last) / (next - last)) * (high - low)
}
