/** The arena that is being drawn, with what was undone; it survives leaving the page, in this browser. */
import { useCallback, useEffect, useReducer } from 'react'
import type { ArenaGeometry } from '../../api/types'
import { BASE } from '../../lib/base'
import { EMPTY, type Thing } from './things'

const KEY = `mapless-arena-draft${BASE}`

/** Steps that can be undone. */
const STEPS = 200

interface State {
  past: readonly ArenaGeometry[]
  arena: ArenaGeometry
  future: readonly ArenaGeometry[]
  chosen: Thing | null
  /** Of the last change: changes of one name in a row are one step. */
  name: string | null
}

type Action =
  | { does: 'change'; arena: ArenaGeometry; chosen?: Thing | null; name?: string }
  | { does: 'choose'; chosen: Thing | null }
  | { does: 'undo' | 'redo' }

function reduce(state: State, action: Action): State {
  switch (action.does) {
    case 'choose':
      return { ...state, chosen: action.chosen, name: null }
    case 'undo': {
      const before = state.past.at(-1)
      if (!before) return state
      const future = [state.arena, ...state.future]
      return { past: state.past.slice(0, -1), arena: before, future, chosen: null, name: null }
    }
    case 'redo': {
      const [next, ...future] = state.future
      if (!next) return state
      return { past: [...state.past, state.arena], arena: next, future, chosen: null, name: null }
    }
    case 'change': {
      const { arena, chosen = state.chosen, name = null } = action
      if (arena === state.arena) return { ...state, chosen }
      const goesOn = name !== null && name === state.name
      const past = goesOn ? state.past : [...state.past, state.arena].slice(-STEPS)
      return { past, arena, future: [], chosen, name }
    }
  }
}

function isArena(value: unknown): value is ArenaGeometry {
  const arena = value as Partial<ArenaGeometry> | null
  return (
    typeof arena === 'object' &&
    arena !== null &&
    arena.format === EMPTY.format &&
    typeof arena.name === 'string' &&
    typeof arena.width === 'number' &&
    typeof arena.height === 'number' &&
    [arena.circles, arena.boxes, arena.movers].every(Array.isArray)
  )
}

function remembered(): ArenaGeometry {
  try {
    const draft: unknown = JSON.parse(localStorage.getItem(KEY) ?? 'null')
    if (isArena(draft)) return draft
  } catch {
    // A draft that cannot be read is none.
  }
  return EMPTY
}

export interface Draft {
  arena: ArenaGeometry
  chosen: Thing | null
  /** Changes of one `name` in a row are undone together. */
  change: (arena: ArenaGeometry, how?: { chosen?: Thing | null; name?: string }) => void
  choose: (thing: Thing | null) => void
  undo: (() => void) | null
  redo: (() => void) | null
}

export function useDraft(): Draft {
  const [state, act] = useReducer(reduce, null, () => ({
    past: [],
    arena: remembered(),
    future: [],
    chosen: null,
    name: null,
  }))
  const { arena, chosen, past, future } = state
  useEffect(() => {
    try {
      if (arena === EMPTY) localStorage.removeItem(KEY)
      else localStorage.setItem(KEY, JSON.stringify(arena))
    } catch {
      // Without room for it the draft lasts as long as the page.
    }
  }, [arena])
  const change = useCallback<Draft['change']>((next, how) => act({ does: 'change', arena: next, ...how }), [])
  const choose = useCallback((thing: Thing | null) => act({ does: 'choose', chosen: thing }), [])
  const undo = useCallback(() => act({ does: 'undo' }), [])
  const redo = useCallback(() => act({ does: 'redo' }), [])
  return {
    arena,
    chosen,
    change,
    choose,
    undo: past.length > 0 ? undo : null,
    redo: future.length > 0 ? redo : null,
  }
}
