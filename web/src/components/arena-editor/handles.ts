/** Where a chosen thing can be taken hold of, and what comes of pulling there; and which thing lies under a pointer. */
import type { ArenaGeometry } from '../../api/types'
import {
  type Box,
  type Point,
  placeOf,
  rounded,
  SMALLEST,
  snap,
  snapped,
  type Thing,
  thingsOf,
  turnedTo,
  wayOf,
  within,
  withThing,
  withWay,
} from './things'

export interface Handle extends Point {
  /** "radius", "length+", "turn", "corner 2". */
  name: string
}

const STEPS = 15

const axes = (box: Box) => {
  const angle = ((box.angle ?? 0) * Math.PI) / 180
  return { cos: Math.cos(angle), sin: Math.sin(angle) }
}

/** @param reach metres from a thing to the handle that turns it. */
export function handlesOf(arena: ArenaGeometry, { part, index }: Thing, reach: number): Handle[] {
  if (part === 'circles') {
    const circle = arena.circles[index]
    return circle ? [{ name: 'radius', x: circle.x + circle.radius, y: circle.y }] : []
  }
  if (part === 'boxes') {
    const box = arena.boxes[index]
    if (!box) return []
    const { cos, sin } = axes(box)
    const at = (u: number, v: number) => ({ x: box.x + cos * u - sin * v, y: box.y + sin * u + cos * v })
    return [
      { name: 'length+', ...at(box.length / 2, 0) },
      { name: 'length-', ...at(-box.length / 2, 0) },
      { name: 'width+', ...at(0, box.width / 2) },
      { name: 'width-', ...at(0, -box.width / 2) },
      { name: 'turn', ...at(box.length / 2 + reach, 0) },
    ]
  }
  if (part === 'movers') {
    const mover = arena.movers[index]
    return mover ? wayOf(mover).map(({ x, y }, corner) => ({ name: `corner ${corner}`, x, y })) : []
  }
  if (part === 'start' && arena.start) {
    const heading = ((arena.start.heading ?? 0) * Math.PI) / 180
    return [
      {
        name: 'turn',
        x: arena.start.x + 1.5 * reach * Math.cos(heading),
        y: arena.start.y + 1.5 * reach * Math.sin(heading),
      },
    ]
  }
  return []
}

/** The arena with a handle of a thing pulled to a point. */
export function pulled(
  arena: ArenaGeometry,
  thing: Thing,
  name: string,
  to: Point,
  grid: number,
): ArenaGeometry {
  const place = placeOf(arena, thing)
  if (!place) return arena
  const toward = () => {
    const degrees = (Math.atan2(to.y - place.y, to.x - place.x) * 180) / Math.PI
    return turnedTo(grid ? Math.round(degrees / STEPS) * STEPS : Math.round(degrees))
  }
  if (thing.part === 'circles')
    return withThing(arena, thing, {
      radius: Math.max(SMALLEST, snap(Math.hypot(to.x - place.x, to.y - place.y), grid)),
    })
  if (thing.part === 'start') return withThing(arena, thing, { heading: toward() })
  if (thing.part === 'movers') {
    const mover = arena.movers[thing.index]
    const corner = Number(name.slice('corner '.length))
    return mover
      ? withThing(
          arena,
          thing,
          withWay(
            mover,
            wayOf(mover).map((each, at) => (at === corner ? snapped(to, grid) : each)),
          ),
        )
      : arena
  }
  const box = thing.part === 'boxes' ? arena.boxes[thing.index] : undefined
  if (!box) return arena
  if (name === 'turn') return withThing(arena, thing, { angle: toward() })
  const { cos, sin } = axes(box)
  const side = name.startsWith('length') ? 'length' : 'width'
  const sign = name.endsWith('+') ? 1 : -1
  const [dx, dy] = side === 'length' ? [sign * cos, sign * sin] : [-sign * sin, sign * cos]
  // The opposite side stays where it is.
  const before = box[side]
  const reached = dx * (to.x - box.x) + dy * (to.y - box.y) + before / 2
  const size = Math.max(SMALLEST, snap(reached, grid))
  return withThing(arena, thing, {
    [side]: size,
    x: rounded(box.x + (dx * (size - before)) / 2),
    y: rounded(box.y + (dy * (size - before)) / 2),
  })
}

/** Metres from a point to a thing's edge, negative within it. */
function distanceTo(arena: ArenaGeometry, { part, index }: Thing, at: Point, mark: number): number {
  if (part === 'circles') {
    const circle = arena.circles[index]
    return circle ? Math.hypot(at.x - circle.x, at.y - circle.y) - circle.radius : Number.POSITIVE_INFINITY
  }
  if (part === 'boxes') {
    const box = arena.boxes[index]
    if (!box) return Number.POSITIVE_INFINITY
    const { cos, sin } = axes(box)
    const along = Math.abs(cos * (at.x - box.x) + sin * (at.y - box.y)) - box.length / 2
    const across = Math.abs(cos * (at.y - box.y) - sin * (at.x - box.x)) - box.width / 2
    const outside = Math.hypot(Math.max(along, 0), Math.max(across, 0))
    return outside + Math.min(Math.max(along, across), 0)
  }
  if (part === 'movers') {
    const mover = arena.movers[index]
    if (!mover) return Number.POSITIVE_INFINITY
    const way = wayOf(mover)
    const first = way[0]
    const disc = first ? Math.hypot(at.x - first.x, at.y - first.y) - mover.radius : Number.POSITIVE_INFINITY
    return Math.min(disc, ...way.slice(1).map((end, before) => toSegment(at, way[before] ?? end, end)))
  }
  const place = arena[part]
  return place ? Math.hypot(at.x - place.x, at.y - place.y) - mark : Number.POSITIVE_INFINITY
}

function toSegment(at: Point, from: Point, to: Point): number {
  const [dx, dy] = [to.x - from.x, to.y - from.y]
  const length = dx * dx + dy * dy
  const share = length ? Math.min(1, Math.max(0, ((at.x - from.x) * dx + (at.y - from.y) * dy) / length)) : 0
  return Math.hypot(at.x - from.x - share * dx, at.y - from.y - share * dy)
}

/**
 * What lies under a pointer: what is drawn above before what is drawn below, and of obstacles the one that it is deepest in.
 * @param slack metres beside a thing that still count.
 * @param mark metres from the middle of start and target to their edges.
 */
export function thingAt(arena: ArenaGeometry, at: Point, slack: number, mark: number): Thing | null {
  let best: { thing: Thing; distance: number } | null = null
  for (const thing of thingsOf(arena)) {
    const above = thing.part !== 'circles' && thing.part !== 'boxes'
    if (!above && best && best.thing.part !== 'circles' && best.thing.part !== 'boxes') break
    const distance = distanceTo(arena, thing, at, mark)
    if (distance <= slack && (!best || distance < best.distance)) best = { thing, distance }
  }
  return best?.thing ?? null
}

/** The handle under a pointer. */
export function handleAt(handles: readonly Handle[], at: Point, slack: number): Handle | null {
  let best: Handle | null = null
  let nearest = slack
  for (const handle of handles) {
    const distance = Math.hypot(at.x - handle.x, at.y - handle.y)
    if (distance <= nearest) {
      best = handle
      nearest = distance
    }
  }
  return best
}

/** Moves by whole steps of the grid; start and target no further than the walls. */
export function dragged(
  arena: ArenaGeometry,
  thing: Thing,
  from: Point,
  to: Point,
  grid: number,
): Point | null {
  const place = placeOf(arena, thing)
  if (!place) return null
  const wanted = snapped({ x: place.x + to.x - from.x, y: place.y + to.y - from.y }, grid)
  const reached = thing.part === 'start' || thing.part === 'target' ? within(arena, wanted) : wanted
  return { x: reached.x - place.x, y: reached.y - place.y }
}
