/** Reading and writing nested form values by path. */
import type { Json } from './schema'

export type Path = readonly (string | number)[]

/** The path as text, the key of errors and inputs: ["training", "steps"] -> "training.steps". */
export const pathKey = (path: Path): string => path.join('.')

/** The value at `path`, or undefined where there is none. */
export function valueAt(values: Json, path: Path): Json | undefined {
  let value: Json | undefined = values
  for (const key of path) {
    if (value === null || typeof value !== 'object') return undefined
    value = Array.isArray(value) ? value[Number(key)] : value[key]
  }
  return value
}

/**
 * The path with the names of a list's objects in place of their positions: ["terms", 1, "weight"] -> ["terms", "collision",
 * "weight"]. So it leads to the same term when others come and go.
 */
export function namedPath(values: Json, path: Path): string[] {
  return path.map((key, depth) => {
    const list = valueAt(values, path.slice(0, depth))
    const item = Array.isArray(list) ? valueAt(list, [key]) : undefined
    return String(valueAt(item ?? null, ['label']) ?? valueAt(item ?? null, ['name']) ?? key)
  })
}

/** A copy of `values` with `value` at `path`; what lies beside the path is shared, not copied. */
export function withValue(values: Json, path: Path, value: Json): Json {
  const [key, ...rest] = path
  if (key === undefined) return value
  if (Array.isArray(values)) {
    const copy = [...values]
    copy[Number(key)] = withValue(copy[Number(key)] ?? null, rest, value)
    return copy
  }
  const object = values !== null && typeof values === 'object' ? values : {}
  return { ...object, [key]: withValue(object[key] ?? null, rest, value) }
}

/** Whether two values say the same, whatever the order of their keys. */
export function sameValue(a: Json | undefined, b: Json | undefined): boolean {
  if (a === b) return true
  if (a === null || b === null || typeof a !== 'object' || typeof b !== 'object') return false
  if (Array.isArray(a) !== Array.isArray(b)) return false
  const [left, right] = [Object.entries(a), Object.entries(b)]
  return left.length === right.length && left.every(([key, value]) => sameValue(value, valueAt(b, [key])))
}
