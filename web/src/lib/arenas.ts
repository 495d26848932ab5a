/** What the gallery says about an arena, and how the launch form learns which one was chosen. */
import type { ArenaConfig, ArenaGeometry, ArenaView } from '../api/types'
import type { Json } from '../form/schema'
import { plural, significant } from './format'

/** "10 × 10 m · 17 obstacles · 2 moving · 72 % free". */
export function arenaFacts({ geometry, obstacles, free_share }: ArenaView): string {
  const { width, height } = geometry
  return [
    `${significant(width)} × ${significant(height)} m`,
    obstacles === 0 ? 'no obstacles' : plural(obstacles, 'obstacle'),
    ...(geometry.movers.length > 0 ? [`${geometry.movers.length} moving`] : []),
    `${Math.round(100 * free_share)} % free`,
  ]
    .map((fact) => fact.replaceAll(' ', '\u00a0'))
    .join('\u00a0· ')
}

export type Mover = ArenaGeometry['movers'][number]

/** Where a mover goes, as far as the arena says: corners of its way, or a timed one's places in order. */
export function wayOf(mover: Mover): readonly { x: number; y: number }[] {
  if (mover.kind === 'timed') return mover.keyframes
  return mover.kind === 'walker' ? [] : (mover.waypoints ?? [])
}

/** Whether it goes from the last corner straight to the first. */
export const isRound = (mover: Mover): boolean =>
  mover.kind === 'patrol' || (mover.kind === 'pedestrian' && !mover.stays)

/** The address of the page on which one draws on a copy of this arena. */
export const drawOn = (config: ArenaConfig): string =>
  `/arenas/draw?from=${encodeURIComponent(JSON.stringify(config))}`

/** The address of a launch form with this arena. */
export const trainOn = (config: ArenaConfig): string =>
  `/new?arena=${encodeURIComponent(JSON.stringify(config))}`

/** The arena in a launch form's address, or null: whatever is wrong inside it the server will say. */
export function arenaFromSearch(text: string | null): { [key: string]: Json } | null {
  if (text === null) return null
  try {
    const value: unknown = JSON.parse(text)
    const named = typeof value === 'object' && value !== null && !Array.isArray(value) && 'name' in value
    return named ? (value as { [key: string]: Json }) : null
  } catch {
    return null
  }
}
