/** What lists of episodes show, and in which order. */
import type { EpisodeResult, Outcome } from '../api/types'

export const OUTCOMES: Record<Outcome, { label: string; many: string; color: string }> = {
  collision: { label: 'Collision', many: 'Collisions', color: 'var(--mantine-color-red-6)' },
  timeout: { label: 'Time-out', many: 'Time-outs', color: 'var(--mantine-color-yellow-6)' },
  arrival: { label: 'Arrival', many: 'Arrivals', color: 'var(--mantine-color-green-6)' },
}

const ORDER: readonly Outcome[] = ['collision', 'timeout', 'arrival']

/** An episode with its place in the suite, from 0. */
export interface ListedEpisode extends EpisodeResult {
  index: number
  /** Of its arena; where the list knows it. */
  map?: string
  /** Shortest path over the driven one, 0 where it did not arrive; where the list knows it. */
  spl?: number
}

/** Episodes as they come: of evaluations that were asked for, each with its arena and its SPL. */
export interface FoundEpisodes {
  episodes: readonly EpisodeResult[]
  maps?: readonly string[]
  spl?: readonly number[]
}

/** By what a list can be put in order. */
export const ORDERS = [
  'interest',
  'episode',
  'map',
  'outcome',
  'steps',
  'path',
  'detour',
  'spl',
  'clearance',
] as const
export type Order = (typeof ORDERS)[number]

/** The worst first: what is less comes earlier. */
const WORSE: Record<Exclude<Order, 'interest' | 'map'>, (episode: ListedEpisode) => number> = {
  episode: ({ index }) => index,
  outcome: ({ outcome }) => ORDER.indexOf(outcome),
  steps: ({ steps }) => -steps,
  path: ({ path_length }) => -path_length,
  detour: (episode) => -(detour(episode) ?? Number.MAX_VALUE),
  spl: ({ spl }) => spl ?? 0,
  clearance: ({ min_clearance }) => min_clearance,
}

/** All episodes in an order, the worst first unless it is reversed; what is equal stays by interest. */
export function arranged(
  { episodes, maps, spl }: FoundEpisodes,
  order: Order,
  reversed = false,
): ListedEpisode[] {
  const found = byInterest(episodes).map((episode) => ({
    ...episode,
    map: maps?.[episode.index],
    spl: spl?.[episode.index],
  })) as ListedEpisode[]
  const way = reversed ? -1 : 1
  if (order === 'interest') return found
  if (order === 'map')
    return found.sort(
      (one, other) => way * (one.map ?? '').localeCompare(other.map ?? '', 'en', { numeric: true }),
    )
  return found.sort((one, other) => way * (WORSE[order](one) - WORSE[order](other)))
}

/** Failures first, then those that came closest to one: the smaller the clearance, the earlier. */
export function byInterest(episodes: readonly EpisodeResult[]): ListedEpisode[] {
  return episodes
    .map((episode, index) => ({ ...episode, index }))
    .sort(
      (one, other) =>
        ORDER.indexOf(one.outcome) - ORDER.indexOf(other.outcome) ||
        one.min_clearance - other.min_clearance ||
        one.index - other.index,
    )
}

/** How many episodes ended how, those that did not occur left out. */
export function tally(episodes: readonly EpisodeResult[]): [outcome: Outcome, count: number][] {
  return ORDER.map((outcome): [Outcome, number] => [
    outcome,
    episodes.filter((episode) => episode.outcome === outcome).length,
  ]).filter(([, count]) => count > 0)
}

/** Driven path over the shortest one, at least 1; null where the robot did not arrive, or started on its target. */
export function detour({ outcome, path_length, shortest_path }: EpisodeResult): number | null {
  return outcome === 'arrival' && shortest_path > 0 ? Math.max(1, path_length / shortest_path) : null
}
