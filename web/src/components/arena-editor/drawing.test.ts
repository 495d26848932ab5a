import { expect, test } from 'vitest'
import { dragged, handlesOf, pulled, thingAt } from './handles'
import { EMPTY, fullOf, moved, resized, turned, turnedTo } from './things'
import { boxBetween, discFrom, headingTo, walking, wallBetween, withDoor } from './tools'

const wall = { x: 0, y: 1, length: 4, width: 0.2, angle: 0 }
const upright = { x: 1, y: 0, length: 4, width: 0.2, angle: 90 }

test('a wall reaches half its thickness beyond both ends, so that corners close', () => {
  expect(wallBetween({ x: -1, y: 0 }, { x: 2, y: 0 }, 0.2)).toEqual({
    x: 0.5,
    y: 0,
    length: 3.2,
    width: 0.2,
    angle: 0,
  })
  expect(wallBetween({ x: 0, y: 0 }, { x: 0, y: 3 }, 0.1)).toMatchObject({ y: 1.5, length: 3.1, angle: 90 })
})

test('boxes and discs are dragged, or clicked where a usual one will do', () => {
  expect(boxBetween({ x: 1, y: 1 }, { x: -1, y: 2 })).toEqual({ x: 0, y: 1.5, length: 2, width: 1, angle: 0 })
  expect(boxBetween({ x: 1, y: 1 }, { x: 1, y: 1 })).toMatchObject({ x: 1, y: 1, length: 1, width: 0.5 })
  expect(discFrom({ x: 0, y: 0 }, { x: 0.3, y: 0.4 })).toEqual({ x: 0, y: 0, radius: 0.5 })
  expect(headingTo({ x: 0, y: 0 }, { x: 1, y: 0.95 })).toBe(45)
})

test('a door is a gap: what is left of the wall stands on both sides of it', () => {
  const arena = { ...EMPTY, boxes: [wall] }
  const door = withDoor(arena, 0, { x: -0.5, y: 1 }, { door: 1, slides: false })
  expect(door).toMatchObject({
    boxes: [
      { x: -1.5, y: 1, length: 1, width: 0.2 },
      { x: 1, y: 1, length: 2, width: 0.2 },
    ],
    movers: [],
  })
  // At an end there is one piece; a wall that stands upright is opened along its own length.
  expect(withDoor(arena, 0, { x: 9, y: 1 }, { door: 1, slides: false })).toMatchObject({
    boxes: [{ x: -0.5, length: 3 }],
  })
  expect(
    withDoor({ ...EMPTY, boxes: [upright] }, 0, { x: 1, y: 0 }, { door: 2, slides: false }),
  ).toMatchObject({
    boxes: [
      { x: 1, y: -1.5, length: 1 },
      { x: 1, y: 1.5, length: 1 },
    ],
  })
  expect(withDoor({ ...EMPTY, boxes: [{ ...wall, length: 0.9 }] }, 0, wall, { door: 1, slides: false })).toBe(
    'This one is 0.9 m long: too short for a door of 1 m.',
  )
})

test('a sliding door is a row of discs that fills the gap, goes into the wall and comes back', () => {
  const made = withDoor({ ...EMPTY, boxes: [wall] }, 0, { x: -0.5, y: 1 }, { door: 0.9, slides: true })
  if (typeof made === 'string') throw new Error(made)
  expect(made.movers).toHaveLength(3)
  expect(made.movers[0]).toEqual({
    kind: 'timed',
    radius: 0.15,
    loops: true,
    keyframes: [
      { t: 0, x: -0.8, y: 1 },
      { t: 3, x: -0.8, y: 1 },
      { t: 4.5, x: 0.1, y: 1 },
      { t: 7.5, x: 0.1, y: 1 },
      { t: 9, x: -0.8, y: 1 },
    ],
  })
  const full = {
    ...EMPTY,
    boxes: [wall],
    movers: Array.from({ length: 14 }, () => ({
      kind: 'walker' as const,
      radius: 0.2,
      speed: 1,
      sees_robots: false,
    })),
  }
  expect(withDoor(full, 0, { x: 0, y: 1 }, { door: 0.9, slides: true })).toBe(fullOf(full, 'movers', 3))
})

test('somebody goes a way; one corner is where they stand', () => {
  const way = [
    { x: 0, y: 0 },
    { x: 1, y: 0 },
  ]
  expect(walking(EMPTY, way, 'patrol')[0].movers).toMatchObject([{ kind: 'patrol', waypoints: way }])
  expect(walking(EMPTY, way.slice(1), 'patrol')[0].movers).toMatchObject([{ kind: 'pedestrian' }])
})

test('things move by whole steps of the grid, start and target within the walls', () => {
  const arena = { ...EMPTY, boxes: [wall], target: { x: 4, y: 0 } }
  const box = { part: 'boxes' as const, index: 0 }
  expect(dragged(arena, box, { x: 0, y: 0 }, { x: 0.6, y: 0.1 }, 0.25)).toEqual({ x: 0.5, y: 0 })
  expect(moved(arena, box, { x: 0.5, y: -1 }).boxes[0]).toMatchObject({ x: 0.5, y: 0 })
  expect(moved(arena, { part: 'target', index: 0 }, { x: 3, y: 1 }).target).toEqual({ x: 5, y: 1 })
  expect(resized(arena, { width: 6 }).target).toEqual({ x: 3, y: 0 })
  const way = walking(
    arena,
    [
      { x: 0, y: 0 },
      { x: 1, y: 0 },
    ],
    'pedestrian',
  )
  expect(moved(way[0], way[1], { x: 1, y: 1 }).movers[0]).toMatchObject({
    waypoints: [
      { x: 1, y: 1 },
      { x: 2, y: 1 },
    ],
  })
})

test('a side that is pulled moves, and the opposite one stays', () => {
  const arena = { ...EMPTY, boxes: [wall, upright] }
  const box = { part: 'boxes' as const, index: 0 }
  expect(pulled(arena, box, 'length+', { x: 3.1, y: 5 }, 0.25).boxes[0]).toMatchObject({ length: 5, x: 0.5 })
  expect(pulled(arena, box, 'length-', { x: 1, y: 1 }, 0).boxes[0]).toMatchObject({ length: 1, x: 1.5 })
  // Turned by 90 degrees, its length goes up.
  expect(pulled(arena, { part: 'boxes', index: 1 }, 'length+', { x: 1, y: 3 }, 0.5).boxes[1]).toMatchObject({
    length: 5,
    x: 1,
    y: 0.5,
  })
  expect(pulled(arena, box, 'turn', { x: 1, y: 2.1 }, 0.25).boxes[0]).toMatchObject({ angle: 45 })
  expect(turned(arena, box, 200).boxes[0]).toMatchObject({ angle: -160 })
  expect(turnedTo(540)).toBe(180)
  expect(handlesOf(arena, box, 0.5).map(({ name }) => name)).toEqual([
    'length+',
    'length-',
    'width+',
    'width-',
    'turn',
  ])
})

test('a pointer finds what is drawn above first, and of obstacles the nearest', () => {
  const arena = {
    ...EMPTY,
    boxes: [wall],
    circles: [{ x: 0, y: 1, radius: 1 }],
    start: { x: 0, y: 1, heading: 0 },
  }
  expect(thingAt(arena, { x: 0, y: 1 }, 0.1, 0.1)).toEqual({ part: 'start', index: 0 })
  expect(thingAt(arena, { x: 0.5, y: 1.4 }, 0.1, 0.1)).toEqual({ part: 'circles', index: 0 })
  expect(thingAt(arena, { x: 1.9, y: 1 }, 0.1, 0.1)).toEqual({ part: 'boxes', index: 0 })
  expect(thingAt(arena, { x: 4, y: 4 }, 0.1, 0.1)).toBeNull()
})
