/** Settings of a form that are searched instead of set: which they are, and what of it is sent. */
import { createContext, useCallback, useContext, useState } from 'react'
import type { components } from '../api/schema'
import { faultOf } from './faults'
import { type Field, withSettingsInTerms } from './layout'
import type { Problems } from './problems'
import type { Json, Schema } from './schema'
import { namedPath, pathKey, sameValue } from './values'

type Schemas = components['schemas']
export type SearchedSetting = Schemas['RangedSetting-Input'] | Schemas['ListedSetting']

/** What is searched of a field: the text of a range's ends as far as it is typed, or the chosen options. */
export type Searched =
  | { kind: 'range'; low: number | string; high: number | string; log: boolean }
  | { kind: 'list'; values: (string | number | boolean | Json[])[] }

export interface Search {
  /** By the field's key, a reward's terms by their names. */
  searched: Readonly<Record<string, Searched>>
  set: (key: string, searched: Searched | null) => void
}

/** Of the form around; null where nothing can be searched. */
export const SearchContext = createContext<Search | null>(null)

const BASE = 'training.'
/** How many times as large as the value, either way, a fresh range reaches. */
const REACH = 10
const WHOLE_REACH = 2
/** How many times as large the lists are that are tried at first. */
const SIZES = [1, 2, 4]

/** The search of a form, kept in this tab under `key` until it is launched. */
export function useSearchState(key: string): Search & { clear: () => void } {
  const [searched, setSearched] = useState<Record<string, Searched>>(() => {
    try {
      return JSON.parse(sessionStorage.getItem(key) ?? '{}') as Record<string, Searched>
    } catch {
      return {}
    }
  })
  const keep = useCallback(
    (next: Record<string, Searched>) => {
      if (Object.keys(next).length > 0) sessionStorage.setItem(key, JSON.stringify(next))
      else sessionStorage.removeItem(key)
      return next
    },
    [key],
  )
  const set = useCallback(
    (field: string, value: Searched | null) =>
      setSearched((before) => {
        const { [field]: _, ...rest } = before
        return keep(value === null ? rest : { ...rest, [field]: value })
      }),
    [keep],
  )
  const clear = useCallback(() => setSearched(keep({})), [keep])
  return { searched, set, clear }
}

/** Whether a field can be searched, how it is, and how that is changed; null where it can't. */
export function useSearched(
  field: Field | undefined,
  values: Json,
): { searched: Searched | undefined; set: (searched: Searched | null) => void } | null {
  const search = useContext(SearchContext)
  if (search === null || field === undefined || !isSearchable(field)) return null
  const key = searchKey(field.path, values)
  return { searched: search.searched[key], set: (searched) => search.set(key, searched) }
}

/** Under which a field is searched. */
export const searchKey = (path: Field['path'], values: Json): string => pathKey(namedPath(values, path))

/** What trials are measured by is the same for all of them; the server refuses it too. */
const MEASURE = [
  'task.arena',
  'task.arrival_distance',
  'task.collision_distance',
  'task.step_limit',
  'evaluation',
  'device',
]

/** Numbers, choices and lists of whole numbers of the training, but for what trials are measured by. */
function isSearchable(field: Field): boolean {
  if (!field.key.startsWith(BASE) || (field.nullable && field.kind !== 'number')) return false
  const path = field.key.slice(BASE.length)
  if (MEASURE.some((fixed) => path === fixed || path.startsWith(`${fixed}.`))) return false
  if (field.kind === 'choice') return field.options.length > 1
  // Two numbers or none, as what is drawn for every episode lies between, are no list of sizes.
  if (field.kind === 'numbers') return field.schema.items?.type === 'integer' && !!field.schema.minItems
  return field.kind === 'number' || field.kind === 'boolean'
}

/** What a field is searched over at first, from the value that it has. */
export function freshSearch(field: Field, value: Json): Searched {
  if (field.kind === 'numbers') return { kind: 'list', values: larger(field, value) }
  if (field.kind !== 'number') return { kind: 'list', values: optionsOf(field).map((option) => option.value) }
  const { minimum, maximum, exclusiveMinimum, exclusiveMaximum } = field.schema
  const most = maximum ?? exclusiveMaximum ?? Number.POSITIVE_INFINITY
  if (value === null) return middle(minimum ?? exclusiveMinimum ?? 0, Number.isFinite(most) ? most : REACH)
  const least = minimum ?? Number.NEGATIVE_INFINITY
  const number = typeof value === 'number' ? value : 0
  if (!field.integer && most <= 1 && number > most / 2 && number < most) return upTo(most, number)
  const log = !field.integer && number !== 0
  const reach = log ? REACH : WHOLE_REACH
  const less = field.integer ? Math.floor(number / reach) : number / reach
  const [low, high] = number < 0 ? [number * reach, less] : [less, number > 0 ? number * reach : 1]
  const tidy = (end: number) => Number(Math.min(most, Math.max(least, end)).toPrecision(6))
  return { kind: 'range', low: tidy(low), high: tidy(high), log }
}

/** The list that is set, and the same with twice and four times as large numbers as far as they may be so large. */
function larger(field: Field, value: Json): Json[][] {
  const list = Array.isArray(value) ? value : []
  const all = SIZES.map((times) => list.map((one) => (typeof one === 'number' ? one * times : one)))
  return all.filter((one) => faultOf(field.schema, one) === undefined)
}

/** Near an end that it does not reach, as a discount is: what lies between counts, a tenth of it to ten times. */
function upTo(most: number, number: number): Searched {
  const tidy = (left: number) => Number((most - left).toPrecision(6))
  const left = most - number
  return { kind: 'range', low: tidy(Math.min(left * REACH, most / 2)), high: tidy(left / REACH), log: false }
}

/** Where nothing is set: the middle half of what may be, of its logarithm where it may not be 0. */
function middle(least: number, most: number): Searched {
  const log = least > 0
  const at = (share: number) => (log ? least * (most / least) ** share : least + (most - least) * share)
  const tidy = (end: number) => Number(end.toPrecision(2))
  return { kind: 'range', low: tidy(at(0.25)), high: tidy(at(0.75)), log }
}

/** The values of a choice with the words for them. */
export function optionsOf(field: Field): { value: string | number | boolean; label: string }[] {
  if (field.kind === 'boolean')
    return [
      { value: true, label: 'On' },
      { value: false, label: 'Off' },
    ]
  if (field.kind !== 'choice') return []
  const values = (field.schema.enum ?? []) as (string | number | boolean)[]
  return field.options.map(({ value, label }) => ({
    value: values.find((one) => String(one) === value) ?? value,
    label,
  }))
}

/** A field that is searched, and how. */
interface SearchedField {
  field: Field
  searched: Searched
}

/** All that is searched of those fields alone that the form has now. */
export function searchedFields(
  searched: Readonly<Record<string, Searched>>,
  fields: readonly Field[],
  root: Schema,
  values: Json,
): SearchedField[] {
  return withSettingsInTerms(fields, root, values).flatMap((field) => {
    const one = isSearchable(field) ? searched[searchKey(field.path, values)] : undefined
    return one === undefined ? [] : [{ field, searched: one }]
  })
}

/** What is sent of a search. */
export function settingsOf(fields: readonly SearchedField[]): SearchedSetting[] {
  return fields.map(({ field, searched }): SearchedSetting => {
    const path = field.key.slice(BASE.length)
    // What is no number in a list is refused before it is sent.
    if (searched.kind === 'list') return { kind: 'list', path, values: searched.values as ListedValues }
    const { low, high, log } = searched
    return { kind: 'range', path, low: Number(low), high: Number(high), log, points: POINTS }
  })
}

type ListedValues = Schemas['ListedSetting']['values']

/** What is wrong with what is searched, by the field's path. */
export function searchFaults(fields: readonly SearchedField[]): Problems {
  return Object.fromEntries(
    fields.flatMap(({ field, searched }) => {
      const fault = searched.kind === 'range' ? rangeFault(field, searched) : listFault(field, searched)
      return fault ? [[field.key, fault]] : []
    }),
  )
}

function rangeFault({ schema }: Field, { low, high, log }: Searched & { kind: 'range' }): string | undefined {
  const fault = faultOf(schema, low) ?? faultOf(schema, high)
  if (fault) return fault
  if (Number(low) >= Number(high)) return 'It must begin below its end.'
  if (log && Number(low) <= 0 && Number(high) >= 0)
    return 'On a logarithmic scale it must keep to one side of 0.'
  return undefined
}

function listFault({ schema, kind }: Field, { values }: Searched & { kind: 'list' }): string | undefined {
  const fault = kind === 'numbers' && values.map((one) => faultOf(schema, one)).find(Boolean)
  if (fault) return fault
  if (values.length < 2) return 'Choose two or more.'
  const twice = values.some((one, index) => values.slice(0, index).some((other) => sameValue(one, other)))
  return twice ? 'Each only once.' : undefined
}

/** Values of a range in a grid. */
const POINTS = 5
