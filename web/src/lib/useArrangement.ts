/** Which episodes of a list are shown, and in which order: both stand in the address, to be passed on. */
import { useCallback } from 'react'
import { useSearchParams } from 'react-router'
import type { Outcome } from '../api/types'
import { ORDERS, type Order, OUTCOMES } from './episodes'

const OUTCOME = 'outcome'
const ORDER = 'order'

export interface Arrangement {
  outcome: Outcome | 'all'
  order: Order
  /** The best comes first instead. */
  reversed: boolean
}

const isOutcome = (text: string | null): text is Outcome => text !== null && Object.hasOwn(OUTCOMES, text)
const orderOf = (text: string): Order => ORDERS.find((each) => each === text) ?? 'interest'

/** What the address says; setting a part of it leaves the rest of the query as it is. */
export function useArrangement(): [Arrangement, (change: Partial<Arrangement>) => void] {
  const [search, setSearch] = useSearchParams()
  const outcome = search.get(OUTCOME)
  const order = search.get(ORDER) ?? ''
  const arrangement: Arrangement = {
    outcome: isOutcome(outcome) ? outcome : 'all',
    order: orderOf(order.replace(/^-/, '')),
    reversed: order.startsWith('-'),
  }
  const set = useCallback(
    (change: Partial<Arrangement>) =>
      setSearch(
        (before) => {
          const after = new URLSearchParams(before)
          if (change.outcome === 'all') after.delete(OUTCOME)
          else if (change.outcome) after.set(OUTCOME, change.outcome)
          if (change.order === 'interest') after.delete(ORDER)
          else if (change.order) after.set(ORDER, `${change.reversed ? '-' : ''}${change.order}`)
          return after
        },
        { replace: true, preventScrollReset: true },
      ),
    [setSearch],
  )
  return [arrangement, set]
}

/** The query of a page whose list shows the episodes that ended so. */
export const endedSo = (outcome: Outcome): string => `?${OUTCOME}=${outcome}`
