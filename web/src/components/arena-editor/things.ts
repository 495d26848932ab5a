/** What stands in an arena that is drawn: found by name, moved, turned, taken away; every change is a new arena. */
import type { ArenaGeometry } from '../../api/types'
import { type Mover, wayOf } from '../../lib/arenas'
import { significant } from '../../lib/format'

export { type Mover, wayOf }

export type Circle = ArenaGeometry['circles'][number]
export type Box = ArenaGeometry['boxes'][number]

export interface Point {
  x: number
  y: number
}

export interface Thing {
  part: 'circles' | 'boxes' | 'movers' | 'start' | 'target'
  /** Within its part; 0 for start and target. */
  index: number
}

/** What an arena file takes (`sim/config/arena_file.py`). */
export const LIMITS = { side: [0.5, 100], movers: 16, obstacles: 2000, waypoints: 32 } as const

/** Beside which nothing more is drawn: a millimetre of a wall is none. */
export const SMALLEST = 0.05

const DECIMALS = 1e4

export const rounded = (value: number) => Math.round(value * DECIMALS) / DECIMALS

/** To the grid; without one (0) to a centimetre. */
export function snap(value: number, grid: number): number {
  const step = grid || 0.01
  return rounded(Math.round(value / step) * step)
}

export const snapped = ({ x, y }: Point, grid: number): Point => ({ x: snap(x, grid), y: snap(y, grid) })

/** -180 to 180 degrees. */
export function turnedTo(degrees: number): number {
  const turn = ((((degrees + 180) % 360) + 360) % 360) - 180
  return rounded(turn === -180 ? 180 : turn)
}

export const EMPTY: ArenaGeometry = {
  format: 'mapless-arena/1',
  name: '',
  width: 10,
  height: 10,
  circles: [],
  boxes: [],
  movers: [],
  start: null,
  target: null,
}

export const sameThing = (one: Thing | null, other: Thing | null) =>
  one?.part === other?.part && one?.index === other?.index

export const keyOf = ({ part, index }: Thing) => `${part}:${index}`

const NAMES = { circles: 'Disc', boxes: 'Box', movers: 'Mover', start: 'Start', target: 'Target' } as const

export function labelOf({ part, index }: Thing): string {
  return part === 'start' || part === 'target' ? NAMES[part] : `${NAMES[part]} ${index + 1}`
}

export function thingsOf(arena: ArenaGeometry): Thing[] {
  const many = (part: 'circles' | 'boxes' | 'movers') => arena[part].map((_, index) => ({ part, index }))
  return [
    ...(arena.start ? [{ part: 'start' as const, index: 0 }] : []),
    ...(arena.target ? [{ part: 'target' as const, index: 0 }] : []),
    ...many('movers'),
    ...many('circles'),
    ...many('boxes'),
  ]
}

export function withWay(mover: Mover, way: readonly Point[]): Mover {
  if (mover.kind === 'timed')
    return {
      ...mover,
      keyframes: mover.keyframes.map((frame, index) => ({ t: frame.t, ...(way[index] ?? frame) })),
    }
  return mover.kind === 'walker' ? mover : { ...mover, waypoints: way.map(({ x, y }) => ({ x, y })) }
}

/** Where a thing is: its middle, or where it begins; null where it is nowhere. */
export function placeOf(arena: ArenaGeometry, { part, index }: Thing): Point | null {
  if (part === 'start' || part === 'target') return arena[part] ?? null
  if (part === 'movers') {
    const mover = arena.movers[index]
    return (mover && wayOf(mover)[0]) ?? null
  }
  return arena[part][index] ?? null
}

/** Start and target stay within the walls: the format has it so. */
export function within(arena: { width: number; height: number }, { x, y }: Point): Point {
  const clamp = (value: number, side: number) => rounded(Math.min(side / 2, Math.max(-side / 2, value)))
  return { x: clamp(x, arena.width), y: clamp(y, arena.height) }
}

export function resized(arena: ArenaGeometry, size: { width?: number; height?: number }): ArenaGeometry {
  const next = { ...arena, ...size }
  return {
    ...next,
    start: next.start && { ...next.start, ...within(next, next.start) },
    target: next.target && within(next, next.target),
  }
}

type Item = Circle | Box | Mover

const shifted = <Place extends Point>(place: Place, by: Point): Place => ({
  ...place,
  x: rounded(place.x + by.x),
  y: rounded(place.y + by.y),
})

const shiftedItem = (item: Item, by: Point): Item =>
  'kind' in item
    ? withWay(
        item,
        wayOf(item).map((place) => shifted(place, by)),
      )
    : shifted(item, by)

/** An arena with one of its things replaced. */
export function withThing(arena: ArenaGeometry, { part, index }: Thing, item: object): ArenaGeometry {
  if (part === 'start' || part === 'target') return { ...arena, [part]: { ...arena[part], ...item } }
  const items: readonly Item[] = arena[part]
  return { ...arena, [part]: items.map((each, at) => (at === index ? { ...each, ...item } : each)) }
}

export function moved(arena: ArenaGeometry, thing: Thing, by: Point): ArenaGeometry {
  if (thing.part === 'start' || thing.part === 'target') {
    const place = arena[thing.part]
    return place ? withThing(arena, thing, within(arena, shifted(place, by))) : arena
  }
  const item = arena[thing.part][thing.index]
  return item ? withThing(arena, thing, shiftedItem(item, by)) : arena
}

export function turned(arena: ArenaGeometry, thing: Thing, degrees: number): ArenaGeometry {
  if (thing.part === 'start' && arena.start)
    return withThing(arena, thing, { heading: turnedTo((arena.start.heading ?? 0) + degrees) })
  const box = thing.part === 'boxes' ? arena.boxes[thing.index] : undefined
  return box ? withThing(arena, thing, { angle: turnedTo((box.angle ?? 0) + degrees) }) : arena
}

export function removed(arena: ArenaGeometry, { part, index }: Thing): ArenaGeometry {
  if (part === 'start' || part === 'target') return { ...arena, [part]: null }
  const items: readonly Item[] = arena[part]
  return { ...arena, [part]: items.filter((_, at) => at !== index) }
}

/** Why there is no room for one more of these; null where there is. */
export function fullOf(arena: ArenaGeometry, part: 'circles' | 'boxes' | 'movers', more = 1): string | null {
  if (part === 'movers')
    return arena.movers.length + more > LIMITS.movers
      ? `An arena has at most ${LIMITS.movers} movers: take one away first.`
      : null
  return arena.circles.length + arena.boxes.length + more > LIMITS.obstacles
    ? `An arena has at most ${LIMITS.obstacles} obstacles: take one away first.`
    : null
}

/** With one thing more, and which one that is. */
export function added(
  arena: ArenaGeometry,
  part: 'circles' | 'boxes' | 'movers',
  item: Item,
): [ArenaGeometry, Thing] {
  return [
    { ...arena, [part]: [...arena[part], item] },
    { part, index: arena[part].length },
  ]
}

/** A copy a step aside; start and target are there once. */
export function duplicated(arena: ArenaGeometry, thing: Thing, by: Point): [ArenaGeometry, Thing] | null {
  if (thing.part === 'start' || thing.part === 'target') return null
  const item = arena[thing.part][thing.index]
  return item ? added(arena, thing.part, shiftedItem(item, by)) : null
}

/** "Box 2, 3 × 0.1 m, at 1.5, 0": for screen readers. */
export function described(arena: ArenaGeometry, thing: Thing): string {
  const place = placeOf(arena, thing)
  const at = place
    ? `at ${significant(rounded(place.x))}, ${significant(rounded(place.y))}`
    : 'goes where it likes'
  const box = thing.part === 'boxes' ? arena.boxes[thing.index] : undefined
  const circle = thing.part === 'circles' ? arena.circles[thing.index] : undefined
  const size = box
    ? `${significant(box.length)} × ${significant(box.width)} m, `
    : circle
      ? `radius ${significant(circle.radius)} m, `
      : ''
  return `${labelOf(thing)}, ${size}${at}`
}
