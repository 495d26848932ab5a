/** Rows that are put into another order: dragged by a handle with mouse, pen or finger, or moved by Alt and the arrow keys. */
import { type KeyboardEvent, type PointerEvent, useState } from 'react'

export interface Drop {
  /** The row that another one is put beside. */
  beside: string
  side: 'before' | 'after'
}

/** What marks a row, so that it is found under a pointer. */
const ROW = 'data-drag-row'

/** Where a row that is let go at a height of the screen would come to stand; null where it would stay. */
export function dropAt(
  rows: readonly { id: string; top: number; bottom: number }[],
  dragged: string,
  y: number,
): Drop | null {
  const from = rows.findIndex(({ id }) => id === dragged)
  const found = rows.findIndex(({ bottom }) => y < bottom)
  const at = found < 0 ? rows.length - 1 : found
  const row = rows[at]
  if (!row || at === from) return null
  const side = y < (row.top + row.bottom) / 2 ? 'before' : 'after'
  // The edges that it shares with its neighbours.
  if ((side === 'after' && at === from - 1) || (side === 'before' && at === from + 1)) return null
  return { beside: row.id, side }
}

/**
 * A list of rows, by id in their order; `onDrop` is told of a row and where it goes. Rows get `rowOf(id)`, handles `handleOf(id)`.
 */
export function useDrag(ids: readonly string[], onDrop: (id: string, drop: Drop) => void) {
  const [dragged, setDragged] = useState<string | null>(null)
  const [drop, setDrop] = useState<Drop | null>(null)
  const end = () => {
    setDragged(null)
    setDrop(null)
  }
  const rowOf = (id: string) => ({
    [ROW]: id,
    'data-dragged': dragged === id || undefined,
    'data-drop': drop?.beside === id ? drop.side : undefined,
  })
  const handleOf = (id: string) => ({
    onPointerDown: (event: PointerEvent<HTMLElement>) => {
      if (event.button !== 0) return
      event.currentTarget.setPointerCapture(event.pointerId)
      setDragged(id)
    },
    onPointerMove: (event: PointerEvent<HTMLElement>) => {
      if (dragged === id) setDrop(dropAt(rowsOf(event.currentTarget), id, event.clientY))
    },
    onPointerUp: (event: PointerEvent<HTMLElement>) => {
      if (dragged !== id) return
      const at = dropAt(rowsOf(event.currentTarget), id, event.clientY)
      end()
      if (at) onDrop(id, at)
    },
    onPointerCancel: end,
    onKeyDown: (event: KeyboardEvent<HTMLElement>) => {
      if (event.key === 'Escape') return end()
      const by = event.altKey ? { ArrowUp: -1, ArrowDown: 1 }[event.key] : undefined
      if (by === undefined) return
      event.preventDefault()
      const beside = ids[ids.indexOf(id) + by]
      if (beside === undefined) return
      onDrop(id, { beside, side: by < 0 ? 'before' : 'after' })
    },
  })
  return { rowOf, handleOf }
}

/** The rows of the list of a handle, where they are on the screen. */
function rowsOf(handle: HTMLElement) {
  const rows = [...(handle.closest('tbody')?.querySelectorAll<HTMLElement>(`[${ROW}]`) ?? [])]
  return rows.map((row) => {
    const { top, bottom } = row.getBoundingClientRect()
    return { id: row.getAttribute(ROW) ?? '', top, bottom }
  })
}
