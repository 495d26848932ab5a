/** The drawing by keyboard: whatever a pointer does, keys do. */
import { type KeyboardEvent, useEffect } from 'react'
import {
  described,
  duplicated,
  keyOf,
  moved,
  type Point,
  removed,
  sameThing,
  thingsOf,
  turned,
} from './things'
import type { Tool } from './tools'
import type { Draft } from './useDraft'
import type { GestureState } from './useGestures'
import type { View } from './useView'

const ARROWS: Record<string, Point | undefined> = {
  ArrowLeft: { x: -1, y: 0 },
  ArrowRight: { x: 1, y: 0 },
  ArrowUp: { x: 0, y: 1 },
  ArrowDown: { x: 0, y: -1 },
}

/** Metres that an arrow key moves without a grid. */
const FREE_STEP = 0.05
/** With Shift: this many steps at once. */
const LEAP = 5
const TURN = 15

interface Keys {
  draft: Draft
  view: View
  tool: Tool
  setTool: (tool: Tool) => void
  grid: number
  gestures: GestureState
  say: (sentence: string) => void
}

/** Undo and redo wherever the focus is, but in a field, which has an undo of its own. */
export function useUndoKeys({ undo, redo }: Pick<Draft, 'undo' | 'redo'>) {
  useEffect(() => {
    const onKey = (event: globalThis.KeyboardEvent) => {
      const inField = event.target instanceof Element && event.target.closest('input, textarea, select')
      if (!(event.ctrlKey || event.metaKey) || event.altKey || inField) return
      const key = event.key.toLowerCase()
      const act = key === 'y' || (key === 'z' && event.shiftKey) ? redo : key === 'z' ? undo : undefined
      if (act === undefined) return
      event.preventDefault()
      act?.()
    }
    window.addEventListener('keydown', onKey)
    return () => window.removeEventListener('keydown', onKey)
  }, [undo, redo])
}

export function useKeys({ draft, view, tool, setTool, grid, gestures, say }: Keys) {
  const { arena, chosen } = draft

  const arrow = (by: Point, leap: boolean) => {
    const step = (grid || FREE_STEP) * (leap ? LEAP : 1)
    if (!chosen) {
      const far = 80 * view.pixel
      return view.look({ x: view.centre.x + by.x * far, y: view.centre.y + by.y * far })
    }
    const next = moved(arena, chosen, { x: by.x * step, y: by.y * step })
    draft.change(next, { name: `move ${keyOf(chosen)}` })
    say(described(next, chosen))
  }

  const goOn = (by: 1 | -1) => {
    const things = thingsOf(arena)
    const at = things.findIndex((thing) => sameThing(thing, chosen))
    const next =
      things[(at === -1 ? (by === 1 ? 0 : things.length - 1) : at + by + things.length) % things.length]
    if (!next) return say('Nothing stands here yet.')
    draft.choose(next)
    say(described(arena, next))
  }

  /** What a click in the middle of what is seen would do. */
  const press = () => {
    const middle = view.centre
    if (tool === 'way') return gestures.drawing ? gestures.endWay() : gestures.addCorner(middle)
    if (tool === 'door') {
      const wall = chosen?.part === 'boxes' ? arena.boxes[chosen.index] : undefined
      return wall
        ? gestures.openDoor(wall, 0)
        : say('Choose a wall or a box first: the door opens in its middle.')
    }
    if (tool !== 'select') gestures.draw(middle, middle)
  }

  return (event: KeyboardEvent) => {
    const { key } = event
    const plain = !event.ctrlKey && !event.metaKey && !event.altKey
    const by = ARROWS[key]
    if (by && plain) arrow(by, event.shiftKey)
    else if ((key === 'Delete' || key === 'Backspace') && chosen && plain)
      draft.change(removed(arena, chosen), { chosen: null })
    else if (key === 'Escape' && plain) {
      if (gestures.drawing) gestures.cancel()
      else if (tool !== 'select') setTool('select')
      else draft.choose(null)
    } else if (key === 'Enter' && plain) press()
    else if (key.toLowerCase() === 'd' && (event.ctrlKey || event.metaKey) && chosen) {
      const made = duplicated(arena, chosen, { x: grid || 0.25, y: -(grid || 0.25) })
      if (made) draft.change(made[0], { chosen: made[1] })
    } else if (key.toLowerCase() === 'r' && plain && chosen)
      draft.change(turned(arena, chosen, event.shiftKey ? -TURN : TURN), { name: `turn ${keyOf(chosen)}` })
    else if (key === 'n' && plain) goOn(1)
    else if (key === 'p' && plain) goOn(-1)
    else if ((key === '+' || key === '=') && plain) view.zoomBy(1.5)
    else if (key === '-' && plain) view.zoomBy(1 / 1.5)
    else return
    event.preventDefault()
  }
}
