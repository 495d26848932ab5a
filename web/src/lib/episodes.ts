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
