/** From a schema and the current values to the fields of a form: which there are, and under which heading. */
import { words } from '../lib/format'
import { branches, type Json, resolve, type Schema, withoutNull } from './schema'
import { type Path, pathKey, sameValue, valueAt } from './values'

/** What a field offers to choose from. */
interface Option {
  value: string
  label: string
}

type FieldKind =
  | { kind: 'text' }
  | { kind: 'number'; integer: boolean }
  | { kind: 'numbers' }
  | { kind: 'boolean' }
  | { kind: 'choice'; options: Option[] }
  /** A discriminated union: choosing swaps the object at `path` for another branch's. */
  | { kind: 'union'; options: Option[]; tag: string }
  /** A list of objects of several kinds; presets are whole lists, by title. */
  | { kind: 'terms'; item: Schema; presets: Record<string, Json> }

/** One field; `path` is where its value lies. */
export type Field = FieldKind & {
  path: Path
  key: string
  label: string
  schema: Schema
  nullable: boolean
  advanced: boolean
  /** Headings from the outside in: ["Task", "Robot"]. */
  trail: readonly string[]
}

interface Place {
  path: Path
  trail: readonly string[]
  advanced: boolean
}

/** All fields below `schema`, in the model's order; of a union only those of the branch that `values` has chosen. */
export function fieldsOf(schema: Schema, root: Schema, values: Json): Field[] {
  return fieldsAt(schema, root, values, { path: [], trail: [], advanced: false }, '')
}

function fieldsAt(unresolved: Schema, root: Schema, values: Json, place: Place, name: string): Field[] {
  const { schema, nullable } = withoutNull(resolve(unresolved, root))
  const label = schema.title ?? words(name)
  const advanced = place.advanced || schema['x-advanced'] === true
  const field = (kind: FieldKind): Field[] => [
    { ...kind, ...place, key: pathKey(place.path), label, schema, nullable, advanced },
  ]

  if (schema.discriminator) {
    const tag = schema.discriminator.propertyName
    const all = branches(schema, root)
    const chosen = valueAt(values, [...place.path, tag])
    const branch = all.find((one) => one.tag === chosen)
    const choice = field({
      kind: 'union',
      tag,
      options: all.map((one) => ({ value: one.tag, label: one.label })),
    })
    return branch
      ? [...choice, ...properties(branch.schema, root, values, { ...place, advanced }, label, tag)]
      : choice
  }
  if (schema.properties) return properties(schema, root, values, { ...place, advanced }, label)
  if (schema.const !== undefined) {
    // An object's only kind so far: named by its heading ("Algorithm"), with the field's own title as the choice ("PPO").
    const heading = place.trail.at(-1) ?? label
    const value = String(schema.const)
    const [only] = field({
      kind: 'choice',
      options: [{ value, label: label === heading ? words(value) : label }],
    })
    return only ? [{ ...only, label: heading }] : []
  }
  if (schema.enum) {
    return field({
      kind: 'choice',
      options: schema.enum.map((one) => ({ value: String(one), label: words(String(one)) })),
    })
  }
  switch (schema.type) {
    case 'boolean':
      return field({ kind: 'boolean' })
    case 'integer':
    case 'number':
      return field({ kind: 'number', integer: schema.type === 'integer' })
    case 'array': {
      const item = resolve(schema.items ?? {}, root)
      return item.discriminator
        ? field({ kind: 'terms', item, presets: schema['x-presets'] ?? {} })
        : field({ kind: 'numbers' })
    }
    default:
      return field({ kind: 'text' })
  }
}

/** The fields, and behind each list of objects what can be set of these. */
export function withSettingsInTerms(fields: readonly Field[], root: Schema, values: Json): Field[] {
  return fields.flatMap((field) => [
    field,
    ...(field.kind === 'terms' ? settingsInTerms(field, root, values) : []),
  ])
}

/** What can be set of each object in a list, such as a reward's terms: "Collision, weight". */
export function settingsInTerms(field: Field & { kind: 'terms' }, root: Schema, values: Json): Field[] {
  const list = valueAt(values, field.path)
  const tag = field.item.discriminator?.propertyName ?? 'name'
  const kinds = branches(field.item, root)
  return (Array.isArray(list) ? list : []).flatMap((term, index) => {
    const kind = kinds.find((one) => one.tag === valueAt(term, [tag]))
    const own = valueAt(term, ['label'])
    const label = typeof own === 'string' ? words(own) : kind?.label
    return Object.entries(kind?.schema.properties ?? {})
      .filter(([name]) => name !== tag)
      .flatMap(([name, schema]) => {
        const place = { path: [...field.path, index, name], trail: field.trail, advanced: field.advanced }
        return fieldsAt(schema, root, values, place, name)
      })
      .map((one) => ({ ...one, label: `${label}, ${one.label.toLowerCase()}` }))
  })
}

function properties(
  schema: Schema,
  root: Schema,
  values: Json,
  place: Place,
  heading: string,
  skip?: string,
): Field[] {
  // The form itself is no heading of its fields.
  const trail = place.path.length === 0 ? place.trail : [...place.trail, heading]
  return Object.entries(schema.properties ?? {})
    .filter(([key, one]) => key !== skip && !one['x-hidden'] && isOfUse(one, values, place.path))
    .flatMap(([key, one]) =>
      fieldsAt(one, root, values, { ...place, path: [...place.path, key], trail }, key),
    )
}

/** Whether a field changes anything: the number that it needs is not 0. */
const isOfUse = (schema: Schema, values: Json, path: Path): boolean =>
  schema['x-needs'] === undefined || valueAt(values, [...path, schema['x-needs']]) !== 0

/**
 * What a field holds in a fresh form: of another kind of object than the fresh form has (another robot, another algorithm) its
 * own default.
 */
export function initialOf(field: Field, values: Json, initial: Json): Json | undefined {
  const other = field.path.slice(1).some((_, depth) => {
    const kind = [...field.path.slice(0, depth + 1), 'name']
    return !sameValue(valueAt(values, kind), valueAt(initial, kind))
  })
  return other && field.kind !== 'union'
    ? (field.schema.default as Json | undefined)
    : valueAt(initial, field.path)
}

/** Fields that share their innermost heading, in order of first appearance. */
export function grouped(fields: readonly Field[]): [heading: string, fields: Field[]][] {
  const groups = new Map<string, Field[]>()
  for (const field of fields) {
    const heading = field.trail.at(-1) ?? ''
    groups.set(heading, [...(groups.get(heading) ?? []), field])
  }
  return [...groups]
}
