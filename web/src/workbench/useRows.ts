/** The rows of the table: trainings, part by part as one scrolls, or groups with the trainings of those that are open. */
import { keepPreviousData, useQueries } from '@tanstack/react-query'
import { useEffect, useMemo, useRef } from 'react'
import { $api } from '../api/client'
import type { Group, ListedExperiment } from '../api/types'
import { askedFor } from './cells'
import type { TableView } from './view'

const PART = 100
/** Of an open group; the rest is found by its query. */
export const OF_A_GROUP = 50

export type Row =
  | { kind: 'training'; key: string; experiment: ListedExperiment; nested: boolean }
  | { kind: 'group'; key: string; group: Group; open: boolean }
  | { kind: 'more'; key: string; group: Group }

export interface Rows {
  rows: readonly Row[]
  /** Trainings that the query finds. */
  total: number | undefined
  error: unknown
  isPending: boolean
  refetch: () => void
  /** Asks for what follows, if anything does. */
  more: () => void
}

/** While a query is at fault, as one is that is still being typed, the rows of the last one that was not. */
export function useRows(view: TableView, open: ReadonlySet<string>): Rows {
  const asked = useAskedRows(view, open)
  const good = useRef(asked)
  useEffect(() => {
    if (!asked.error && !asked.isPending) good.current = asked
  })
  return asked.error
    ? { ...good.current, error: asked.error, refetch: asked.refetch, isPending: false }
    : asked
}

function useAskedRows(view: TableView, open: ReadonlySet<string>): Rows {
  const grouped = view.by !== ''
  const column = useMemo(() => askedFor(view.columns), [view.columns])
  const common = { place: view.place, column, ...(view.project ? { project: view.project } : {}) }
  const list = $api.useInfiniteQuery(
    'get',
    '/api/experiments',
    { params: { query: { ...common, query: view.query, sort: view.sort, limit: PART } } },
    {
      pageParamName: 'after',
      initialPageParam: null as string | null,
      getNextPageParam: ({ next }) => next,
      placeholderData: keepPreviousData,
      enabled: !grouped,
    },
  )
  const groups = $api.useQuery(
    'get',
    '/api/workbench/groups',
    { params: { query: { ...common, query: view.query, by: view.by } } },
    { placeholderData: keepPreviousData, enabled: grouped },
  )
  const shown = grouped ? (groups.data?.items ?? []) : []
  const opened = shown.filter((group) => open.has(group.query))
  const inside = useQueries({
    queries: opened.map((group) =>
      $api.queryOptions('get', '/api/experiments', {
        params: {
          query: { ...common, query: within(view.query, group), sort: view.sort, limit: OF_A_GROUP },
        },
      }),
    ),
  })
  if (!grouped) {
    const pages = list.data?.pages ?? []
    return {
      rows: pages
        .flatMap(({ items }) => items)
        .map((experiment) => ({ kind: 'training', key: experiment.id, experiment, nested: false })),
      total: pages[0]?.total,
      error: list.error,
      isPending: list.isPending,
      refetch: () => void list.refetch(),
      more: () => {
        if (list.hasNextPage) void list.fetchNextPage({ cancelRefetch: false })
      },
    }
  }
  return {
    rows: shown.flatMap((group): Row[] => {
      const place = opened.indexOf(group)
      const items = place < 0 ? [] : (inside[place]?.data?.items ?? [])
      return [
        { kind: 'group', key: `group ${group.query}`, group, open: place >= 0 },
        ...items.map(
          (experiment): Row => ({ kind: 'training', key: experiment.id, experiment, nested: true }),
        ),
        ...(place >= 0 && group.experiments > OF_A_GROUP
          ? [{ kind: 'more', key: `more ${group.query}`, group } as Row]
          : []),
      ]
    }),
    total: groups.data?.items.reduce((sum, { experiments }) => sum + experiments, 0),
    error: groups.error,
    isPending: groups.isPending,
    refetch: () => void groups.refetch(),
    more: () => {},
  }
}

/** The query that finds what a group holds. */
export const within = (query: string, group: Group): string =>
  query.trim() ? `(${query}) ${group.query}` : group.query
