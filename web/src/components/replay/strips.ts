/** From an episode's series to its strip charts. */
import type { EpisodeSeries } from '../../api/types'
import { alignSeries, type ChartData, type Line } from '../../charts/series'

type PolicySeries = EpisodeSeries['policies'][number]
export type ChartName = PolicySeries['series'][number]['chart']

export const TITLES: Record<ChartName, string> = {
  ahead: 'Range ahead, m',
  linear: 'Speed, m/s',
  lateral: 'Speed sideways, m/s',
  turning: 'Turning, rad/s',
  steering: 'Steering, rad',
  value: 'Return to come',
  reward: 'Reward of each step',
}
const ORDER = Object.keys(TITLES) as ChartName[]

/** What is asked for stands behind what is driven. */
const ASKED = 'asked for'
/** The sum of a reward's terms. */
export const ALL = 'all'

/** The chart's colour that comes next to each robot's in the picture. */
const ROBOT_COLORS = [0, 1, 6, 5, 3, 4] as const
export const colorOf = (place: number): number => ROBOT_COLORS[place % ROBOT_COLORS.length] ?? 0

/** What a policy is called beside others: A, B, … */
export const letter = (place: number): string => String.fromCharCode(65 + place)

/** The reward's terms that any of them has, the sum first. */
export function termsOf(policies: readonly PolicySeries[]): string[] {
  return [...new Set(policies.flatMap(({ series }) => series.filter(isReward).map(({ name }) => name)))]
}
const isReward = ({ chart }: { chart: ChartName }) => chart === 'reward'

/**
 * The charts that there is something for, in their order. One policy has a line for each series; of several each has one in
 * its robot's colour, of the reward that of `term`.
 */
export function stripsOf(
  policies: readonly PolicySeries[],
  term: string,
): { chart: ChartName; data: ChartData }[] {
  return ORDER.flatMap((chart) => {
    const drawn = policies.flatMap((policy, place) =>
      policy.series
        .filter(
          (one) => one.chart === chart && (policies.length === 1 || chart !== 'reward' || one.name === term),
        )
        .map((one, index) => ({ ...one, steps: policy.times, place, index })),
    )
    if (drawn.length === 0) return []
    const { x, values } = alignSeries(drawn)
    const alone = policies.length === 1
    const lines = drawn.map((one, index): Line => {
      const thin =
        one.name === ASKED && drawn.some(({ place, name }) => place === one.place && name !== ASKED)
      return {
        key: alone ? one.name : `${letter(one.place)}${thin ? `:${one.name}` : ''}`,
        ...(alone ? { label: one.name } : thin ? {} : { label: letter(one.place) }),
        color: alone ? one.index : colorOf(one.place),
        thin,
        values: values[index] ?? [],
      }
    })
    return [{ chart, data: { x, lines } }]
  })
}
