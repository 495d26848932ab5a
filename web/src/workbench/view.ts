/** What the table of trainings shows, as its address says it: query, order, columns, groups, place. */
import { useCallback, useMemo } from 'react'
import { useSearchParams } from 'react-router'
import { BASE } from '../lib/base'

export type Place = 'live' | 'archived' | 'trash'

export interface TableView {
  query: string
  /** Id of the project that is looked at; empty for all. */
  project: string
  /** A key, with a minus before it the largest first. */
  sort: string
  /** Keys after the name, in order. */
  columns: readonly string[]
  /** How many of the columns stay in sight while one scrolls to the right. */
  pinned: number
  /** The key to group by; empty for none. */
  by: string
  place: Place
}

export const DEFAULT_COLUMNS = ['state', 'success', 'seeds', 'arena', 'algorithm', 'reward', 'tag', 'created']
const DEFAULTS: TableView = {
  query: '',
  project: '',
  sort: '-created',
  columns: DEFAULT_COLUMNS,
  pinned: 0,
  by: '',
  place: 'live',
}
const PLACES: readonly string[] = ['live', 'archived', 'trash']

const PROJECT = `mapless.project${BASE}`

/** Id of the project that this browser's person chose last: lists show it, trainings are launched into it. Empty for all. */
export const chosenProject = (): string => localStorage.getItem(PROJECT) ?? ''

export const chooseProject = (id: string): void =>
  id ? localStorage.setItem(PROJECT, id) : localStorage.removeItem(PROJECT)

/** The view that an address's query describes; what it does not say is as usual. */
export function viewOf(search: URLSearchParams, chosen = chosenProject()): TableView {
  const place = search.get('place') ?? ''
  const columns = search.get('columns')
  return {
    query: search.get('q') ?? '',
    project: search.get('project') ?? chosen,
    sort: search.get('sort') || DEFAULTS.sort,
    columns: columns === null ? DEFAULT_COLUMNS : [...new Set(columns.split(',').filter(Boolean))],
    pinned: Math.max(0, Number(search.get('pinned')) || 0),
    by: search.get('by') ?? '',
    place: PLACES.includes(place) ? (place as Place) : 'live',
  }
}

/** The address's query of a view, as short as may be. */
export function addressOf(view: TableView): URLSearchParams {
  const search = new URLSearchParams()
  if (view.query) search.set('q', view.query)
  if (view.project) search.set('project', view.project)
  if (view.sort !== DEFAULTS.sort) search.set('sort', view.sort)
  if (view.columns.join() !== DEFAULT_COLUMNS.join()) search.set('columns', view.columns.join())
  if (view.pinned) search.set('pinned', String(view.pinned))
  if (view.by) search.set('by', view.by)
  if (view.place !== 'live') search.set('place', view.place)
  return search
}

/** The view in the address, and how to change parts of it. */
export function useView(): [TableView, (change: Partial<TableView>) => void] {
  const [search, setSearch] = useSearchParams()
  const chosen = chosenProject()
  const view = useMemo(() => viewOf(search, chosen), [search, chosen])
  const change = useCallback(
    (part: Partial<TableView>) =>
      setSearch((before) => addressOf({ ...viewOf(before), ...part }), {
        replace: true,
        preventScrollReset: true,
      }),
    [setSearch],
  )
  return [view, change]
}

/** What the order is after a column's head was pressed: the largest first, the smallest first, as usual. */
export function nextSort(sort: string, key: string): string {
  if (sort === `-${key}`) return key
  return sort === key ? DEFAULTS.sort : `-${key}`
}
