/** What the tools draw: walls, boxes, discs, doors. */
import type { ArenaGeometry } from '../../api/types'
import {
  added,
  type Box,
  type Circle,
  fullOf,
  type Mover,
  type Point,
  rounded,
  SMALLEST,
  turnedTo,
} from './things'

export const TOOLS = [
  {
    tool: 'select',
    label: 'Select',
    help: 'Click a thing to choose it, drag it to move it; drag the floor to look elsewhere.',
  },
  { tool: 'wall', label: 'Wall', help: 'Drag from one end to the other.' },
  { tool: 'box', label: 'Box', help: 'Drag from corner to corner.' },
  { tool: 'disc', label: 'Disc', help: 'Drag from its middle to its edge.' },
  { tool: 'door', label: 'Door', help: 'Click a wall or a box where the door is to be.' },
  {
    tool: 'way',
    label: "Person's way",
    help: 'Click corner after corner; double-click, or Enter, ends the way.',
  },
  { tool: 'start', label: 'Start', help: "Click the robot's place; drag to where it looks." },
  { tool: 'target', label: 'Target', help: 'Click where it is to go.' },
] as const

export type Tool = (typeof TOOLS)[number]['tool']

export interface ToolSettings {
  /** Metres. */
  thickness: number
  /** Of a door, metres. */
  door: number
  /** Whether a door opens and shuts by itself. */
  slides: boolean
  kind: 'pedestrian' | 'patrol'
}

/** Metres of what is clicked, not dragged. */
const DISC = 0.3
const BOX = [1, 0.5] as const
const WALL = 2

/** Shorter is a click. */
export const isClick = (from: Point, to: Point) => Math.hypot(to.x - from.x, to.y - from.y) < SMALLEST

/** A wall between two points, half its thickness longer at both ends: where walls meet, no gap is left. */
export function wallBetween(from: Point, to: Point, thickness: number): Box {
  const end = isClick(from, to) ? { x: from.x + WALL, y: from.y } : to
  const length = Math.hypot(end.x - from.x, end.y - from.y)
  return {
    x: rounded((from.x + end.x) / 2),
    y: rounded((from.y + end.y) / 2),
    length: rounded(length + thickness),
    width: thickness,
    angle: turnedTo((Math.atan2(end.y - from.y, end.x - from.x) * 180) / Math.PI),
  }
}

export function boxBetween(from: Point, to: Point): Box {
  if (isClick(from, to)) return { ...from, length: BOX[0], width: BOX[1], angle: 0 }
  return {
    x: rounded((from.x + to.x) / 2),
    y: rounded((from.y + to.y) / 2),
    length: Math.max(SMALLEST, rounded(Math.abs(to.x - from.x))),
    width: Math.max(SMALLEST, rounded(Math.abs(to.y - from.y))),
    angle: 0,
  }
}

export const discFrom = (middle: Point, edge: Point): Circle => ({
  ...middle,
  radius: isClick(middle, edge) ? DISC : rounded(Math.hypot(edge.x - middle.x, edge.y - middle.y)),
})

/** What looks from here to there, in whole steps of 15 degrees. */
export const headingTo = (from: Point, to: Point): number =>
  isClick(from, to) ? 0 : turnedTo(Math.round((Math.atan2(to.y - from.y, to.x - from.x) * 12) / Math.PI) * 15)

/** Seconds that a sliding door is shut, opens, is open, and shuts. */
const CYCLE = [3, 1.5, 3, 1.5] as const
/** The discs of a sliding door are as thin as movers may be, or as many as its width needs. */
const LEAF = 0.15
const THINNEST = 0.1

/**
 * A door in a wall or box, across its longer side: a gap, and if it slides what opens and shuts it. All that moves in an
 * arena is discs, so that such a door is a row of them, which goes into the wall beside it and comes back.
 * @returns the arena, or a sentence that says why there is none.
 */
export function withDoor(
  arena: ArenaGeometry,
  index: number,
  at: Point,
  { door, slides }: Pick<ToolSettings, 'door' | 'slides'>,
): ArenaGeometry | string {
  const box = arena.boxes[index]
  if (!box) return 'Click a wall or a box: a door is a gap in one.'
  const along = box.length >= box.width
  const long = along ? box.length : box.width
  if (long < door + SMALLEST) return `This one is ${long} m long: too short for a door of ${door} m.`
  const angle = (((box.angle ?? 0) + (along ? 0 : 90)) * Math.PI) / 180
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)]
  const half = long / 2
  const wanted = cos * (at.x - box.x) + sin * (at.y - box.y)
  const middle = Math.min(half - door / 2, Math.max(door / 2 - half, wanted))
  const point = (t: number) => ({ x: rounded(box.x + cos * t), y: rounded(box.y + sin * t) })
  const pieces = [
    [-half, middle - door / 2],
    [middle + door / 2, half],
  ]
    .filter(([low = 0, high = 0]) => high - low >= SMALLEST)
    .map(([low = 0, high = 0]) => ({
      ...box,
      ...point((low + high) / 2),
      [along ? 'length' : 'width']: rounded(high - low),
    }))
  const full = fullOf(arena, 'boxes', pieces.length - 1)
  if (full) return full
  const boxes = [...arena.boxes.filter((_, other) => other !== index), ...pieces]
  const gap = { ...arena, boxes }
  if (!slides) return gap
  const count = Math.max(1, Math.round(door / (2 * LEAF)))
  const crowded = fullOf(arena, 'movers', count)
  if (crowded) return crowded
  // Into the longer piece: there it is out of the way.
  const side = middle <= 0 ? 1 : -1
  const leaves = Array.from({ length: count }, (_, leaf): Mover => {
    const shut = middle - door / 2 + ((leaf + 0.5) * door) / count
    return {
      kind: 'timed',
      radius: rounded(Math.max(THINNEST, door / count / 2)),
      loops: true,
      keyframes: slide(point(shut), point(shut + side * door)),
    }
  })
  return { ...gap, movers: [...gap.movers, ...leaves] }
}

function slide(shut: Point, open: Point) {
  let time = 0
  return [shut, ...CYCLE.map((_, step) => (step === 1 || step === 2 ? open : shut))].map((place, step) => {
    time += step === 0 ? 0 : (CYCLE[step - 1] ?? 0)
    return { t: time, ...place }
  })
}

/** Somebody who goes this way; one who has a single corner stands there. */
export function walking(arena: ArenaGeometry, way: readonly Point[], kind: ToolSettings['kind']) {
  const mover: Mover =
    kind === 'patrol' && way.length > 1
      ? { kind: 'patrol', radius: 0.25, speed: 1, sees_robots: true, waypoints: [...way] }
      : { kind: 'pedestrian', radius: 0.25, speed: 1, sees_robots: true, stays: false, waypoints: [...way] }
  return added(arena, 'movers', mover)
}
