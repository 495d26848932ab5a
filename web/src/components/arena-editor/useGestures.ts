/** What a pointer does on the drawing: chooses, moves, pulls handles, draws with the tool, looks elsewhere; two pinch. */
import { type PointerEvent, useRef, useState } from 'react'
import type { ArenaGeometry } from '../../api/types'
import { dragged, handleAt, handlesOf, pulled, thingAt } from './handles'
import { added, fullOf, moved, type Point, snapped, type Thing, within } from './things'
import {
  boxBetween,
  discFrom,
  headingTo,
  type Tool,
  type ToolSettings,
  walking,
  wallBetween,
  withDoor,
} from './tools'
import type { Draft } from './useDraft'
import { type Pinch, placeIn, type View } from './useView'

type Gesture =
  | { does: 'move'; thing: Thing; from: Point }
  | { does: 'pull'; thing: Thing; handle: string }
  | { does: 'draw'; from: Point }
  | { does: 'look'; from: { x: number; y: number }; centre: Point }
  | { does: 'tap'; at: Point; slack: number }

/** Pixels beside a thing that still count, by how exactly one points. */
const SLACK = { fine: 5, coarse: 16 }
export const HANDLE_REACH = 30
export const MARK = 9

interface Gestures {
  draft: Draft
  view: View
  tool: Tool
  settings: ToolSettings
  grid: number
  say: (sentence: string) => void
}

export function useGestures({ draft, view, tool, settings, grid, say }: Gestures) {
  const { arena, chosen } = draft
  const [gesture, setGesture] = useState<Gesture | null>(null)
  /** The arena as it would be if the pointer let go now. */
  const [held, setHeld] = useState<{ arena: ArenaGeometry; chosen: Thing | null } | null>(null)
  const [way, setWay] = useState<readonly Point[]>([])
  const [pointer, setPointer] = useState<Point | null>(null)
  /** Where the fingers are, in the window; and what two of them began with, until the last is lifted. */
  const fingers = useRef(new Map<number, { clientX: number; clientY: number }>())
  const pinch = useRef<Pinch | null>(null)

  /** What a tool makes of a drag, or of a click where both are one. */
  const drawn = (from: Point, to: Point): [ArenaGeometry, Thing] | string => {
    switch (tool) {
      case 'wall':
      case 'box':
        return (
          fullOf(arena, 'boxes') ??
          added(
            arena,
            'boxes',
            tool === 'wall' ? wallBetween(from, to, settings.thickness) : boxBetween(from, to),
          )
        )
      case 'disc':
        return fullOf(arena, 'circles') ?? added(arena, 'circles', discFrom(from, to))
      case 'start':
        return [
          { ...arena, start: { ...within(arena, from), heading: headingTo(from, to) } },
          { part: 'start', index: 0 },
        ]
      case 'target':
        return [
          { ...arena, target: within(arena, to) },
          { part: 'target', index: 0 },
        ]
      default:
        return ''
    }
  }

  /** Draws from one point to another; from a keyboard both are one. */
  const draw = (from: Point, to: Point) => {
    const made = drawn(from, to)
    if (typeof made === 'string') say(made)
    else draft.change(made[0], { chosen: made[1] })
  }

  const openDoor = (at: Point, slack: number) => {
    const thing = thingAt(arena, at, slack, 0)
    const made = withDoor(arena, thing?.part === 'boxes' ? thing.index : -1, at, settings)
    if (typeof made === 'string') say(made)
    else draft.change(made, { chosen: null })
  }

  const endWay = (corners = way) => {
    setWay([])
    setPointer(null)
    if (corners.length === 0) return
    const full = fullOf(arena, 'movers')
    if (full) return say(full)
    const [next, thing] = walking(arena, corners, settings.kind)
    draft.change(next, { chosen: thing })
  }

  const addCorner = (at: Point) => {
    const last = way.at(-1)
    // The second click of a double-click adds nothing: it ends the way.
    if (last && last.x === at.x && last.y === at.y) return endWay()
    setWay([...way, at])
  }

  const tap = (at: Point, slack: number) => {
    if (tool === 'door') openDoor(at, slack)
    else addCorner(snapped(at, grid))
  }

  const onPointerDown = (event: PointerEvent<SVGSVGElement>) => {
    if (event.button !== 0) return
    event.currentTarget.setPointerCapture?.(event.pointerId)
    const touches = event.pointerType === 'touch'
    if (touches) {
      fingers.current.set(event.pointerId, { clientX: event.clientX, clientY: event.clientY })
      if (fingers.current.size > 1) {
        // What the first finger had begun it did not mean.
        setHeld(null)
        setGesture(null)
        const between = twoOf(fingers.current)
        const place = placeIn(event.currentTarget, between)
        pinch.current = { place, apart: between.apart, zoom: view.zoom }
        return
      }
    }
    const at = placeIn(event.currentTarget, event)
    const slack = SLACK[touches ? 'coarse' : 'fine'] * view.pixel
    if (tool === 'door' || tool === 'way')
      // Whether a finger comes alone shows when it is lifted.
      return touches ? setGesture({ does: 'tap', at, slack }) : tap(at, slack)
    if (tool !== 'select') {
      const from = snapped(at, grid)
      setGesture({ does: 'draw', from })
      const made = drawn(from, from)
      if (typeof made === 'string') say(made)
      else setHeld({ arena: made[0], chosen: made[1] })
      return
    }
    const handle = chosen && handleAt(handlesOf(arena, chosen, HANDLE_REACH * view.pixel), at, 2 * slack)
    if (chosen && handle) return setGesture({ does: 'pull', thing: chosen, handle: handle.name })
    const thing = thingAt(arena, at, slack, MARK * view.pixel)
    draft.choose(thing)
    setGesture(
      thing
        ? { does: 'move', thing, from: at }
        : { does: 'look', from: { x: event.clientX, y: event.clientY }, centre: view.centre },
    )
  }

  const onPointerMove = (event: PointerEvent<SVGSVGElement>) => {
    if (fingers.current.has(event.pointerId))
      fingers.current.set(event.pointerId, { clientX: event.clientX, clientY: event.clientY })
    if (pinch.current) {
      if (fingers.current.size < 2) return
      const { clientX, clientY, apart } = twoOf(fingers.current)
      const box = event.currentTarget.getBoundingClientRect()
      const middle = { x: clientX - box.x - box.width / 2, y: clientY - box.y - box.height / 2 }
      return view.pinch(pinch.current, middle, apart)
    }
    const at = placeIn(event.currentTarget, event)
    if (tool === 'way' && way.length > 0) setPointer(snapped(at, grid))
    if (!gesture) return
    switch (gesture.does) {
      case 'look':
        return view.look({
          x: gesture.centre.x - (event.clientX - gesture.from.x) * view.pixel,
          y: gesture.centre.y + (event.clientY - gesture.from.y) * view.pixel,
        })
      case 'move': {
        const by = dragged(arena, gesture.thing, gesture.from, at, grid)
        // A click is none: what it chooses stays where it is.
        const still = Math.hypot(at.x - gesture.from.x, at.y - gesture.from.y) < 3 * view.pixel
        if (by && !(still && !held))
          setHeld({ arena: moved(arena, gesture.thing, by), chosen: gesture.thing })
        return
      }
      case 'pull':
        return setHeld({
          arena: pulled(arena, gesture.thing, gesture.handle, at, grid),
          chosen: gesture.thing,
        })
      case 'draw': {
        const made = drawn(gesture.from, snapped(at, grid))
        if (typeof made !== 'string') setHeld({ arena: made[0], chosen: made[1] })
      }
    }
  }

  const lift = (event: PointerEvent<SVGSVGElement>) => {
    fingers.current.delete(event.pointerId)
    if (fingers.current.size === 0) pinch.current = null
  }

  const onPointerUp = (event: PointerEvent<SVGSVGElement>) => {
    lift(event)
    if (gesture?.does === 'tap') tap(gesture.at, gesture.slack)
    if (held) draft.change(held.arena, { chosen: held.chosen })
    setHeld(null)
    setGesture(null)
  }

  const cancel = () => {
    setHeld(null)
    setGesture(null)
    setWay([])
    setPointer(null)
  }

  const onPointerCancel = (event: PointerEvent<SVGSVGElement>) => {
    lift(event)
    cancel()
  }

  return {
    shown: held ?? { arena, chosen },
    way: pointer ? [...way, pointer] : way,
    drawing: way.length > 0 || gesture?.does === 'draw',
    draw,
    openDoor,
    addCorner,
    endWay,
    cancel,
    pointer: { onPointerDown, onPointerMove, onPointerUp, onPointerCancel },
  }
}

/** What is in the middle of the first two fingers, and how far apart they are, pixels. */
function twoOf(fingers: ReadonlyMap<number, { clientX: number; clientY: number }>) {
  const [first = { clientX: 0, clientY: 0 }, second = first] = fingers.values()
  return {
    clientX: (first.clientX + second.clientX) / 2,
    clientY: (first.clientY + second.clientY) / 2,
    apart: Math.max(1, Math.hypot(first.clientX - second.clientX, first.clientY - second.clientY)),
  }
}

export type GestureState = ReturnType<typeof useGestures>
