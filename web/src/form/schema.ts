/** The part of JSON schema that pydantic writes for our configuration models, and its defaults. */
import { words } from '../lib/format'

export interface Schema {
  $ref?: string
  $defs?: Record<string, Schema>
  type?: string
  title?: string
  description?: string
  default?: unknown
  const?: string | number | boolean
  enum?: (string | number)[]
  properties?: Record<string, Schema>
  required?: string[]
  items?: Schema
  anyOf?: Schema[]
  oneOf?: Schema[]
  discriminator?: { propertyName: string; mapping: Record<string, string> }
  minimum?: number
  maximum?: number
  exclusiveMinimum?: number
  exclusiveMaximum?: number
  minLength?: number
  maxLength?: number
  minItems?: number
  maxItems?: number
  'x-advanced'?: boolean
  /** Not for the form: a program fills it in. */
  'x-hidden'?: boolean
  /** The number beside it without which it changes nothing. */
  'x-needs'?: string
  /** Lists to start from, by title. */
  'x-presets'?: Record<string, Json>
  /** A list of which each kind may be there once: ticks, no rows to add. */
  'x-ticks'?: boolean
  /** The hash of an imported arena, which is chosen by its name. */
  'x-imported-arena'?: boolean
}

/** Values of a form: what JSON can hold. */
export type Json = string | number | boolean | null | Json[] | { [key: string]: Json }

/** Follows `$ref`; what stands beside the reference (a title, a default) wins over what it names. */
export function resolve(schema: Schema, root: Schema): Schema {
  if (!schema.$ref) return schema
  const { $ref, ...beside } = schema
  const target = root.$defs?.[$ref.replace('#/$defs/', '')]
  if (!target) throw new Error(`The form's schema has no definition for ${$ref}.`)
  return { ...resolve(target, root), ...beside }
}

/** Splits `T | null` into T and the fact that null is allowed. */
export function withoutNull(schema: Schema): { schema: Schema; nullable: boolean } {
  const some = schema.anyOf?.filter((one) => one.type !== 'null')
  if (!some || some.length === schema.anyOf?.length) return { schema, nullable: false }
  const { anyOf: _, ...beside } = schema
  return {
    schema: some.length === 1 ? { ...some[0], ...beside } : { ...beside, anyOf: some },
    nullable: true,
  }
}

/** A branch of a discriminated union. */
interface Branch {
  tag: string
  label: string
  schema: Schema
}

/** The branches of a discriminated union, in the order in which the model lists them. */
export function branches(schema: Schema, root: Schema): Branch[] {
  const { discriminator } = schema
  if (!discriminator) return []
  // The mapping is sorted by tag; the union itself keeps the model's order.
  const place = ($ref: string) => schema.oneOf?.findIndex((one) => one.$ref === $ref) ?? 0
  const name = discriminator.propertyName
  const all = Object.entries(discriminator.mapping).map(([tag, $ref]) => {
    const branch = resolve({ $ref }, root)
    const own = branch.properties?.[name]
    // A model that stands for several tags is a branch for each of them, which starts with that tag.
    const several = own?.enum?.map(String)
    const schema = several
      ? { ...branch, properties: { ...branch.properties, [name]: { ...own, default: tag } } }
      : branch
    const label = several ? words(tag) : (own?.title ?? branch.title ?? tag)
    return { tag, label, schema, order: [place($ref), several?.indexOf(tag) ?? 0] as const }
  })
  all.sort((a, b) => a.order[0] - b.order[0] || a.order[1] - b.order[1])
  return all.map(({ tag, label, schema }) => ({ tag, label, schema }))
}

/** What a fresh form holds: the schema's defaults all the way down. */
export function defaults(schema: Schema, root: Schema): Json {
  const resolved = resolve(schema, root)
  if (resolved.default !== undefined) return structuredClone(resolved.default) as Json
  if (resolved.const !== undefined) return resolved.const
  const [first] = branches(resolved, root)
  if (first) return defaults(first.schema, root)
  if (resolved.properties)
    return Object.fromEntries(
      Object.entries(resolved.properties).map(([key, one]) => [key, defaults(one, root)]),
    )
  if (resolved.type === 'array') return []
  if (resolved.type === 'string') return ''
  if (resolved.type === 'boolean') return false
  return null
}

/** The allowed range of a number in words, or undefined: "1 to 4096", "above 0, at most 1". */
export function range(schema: Schema, write: (value: number) => string): string | undefined {
  const { minimum, maximum, exclusiveMinimum, exclusiveMaximum } = schema
  if (minimum !== undefined && maximum !== undefined) return `${write(minimum)} to ${write(maximum)}`
  const low =
    minimum !== undefined
      ? `at least ${write(minimum)}`
      : exclusiveMinimum !== undefined
        ? `above ${write(exclusiveMinimum)}`
        : undefined
  const high =
    maximum !== undefined
      ? `at most ${write(maximum)}`
      : exclusiveMaximum !== undefined
        ? `below ${write(exclusiveMaximum)}`
        : undefined
  return [low, high].filter(Boolean).join(', ') || undefined
}
