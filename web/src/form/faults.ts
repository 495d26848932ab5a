/**
 * What is wrong with values by the schema alone, in one wording for every kind of field, as one types. What only the server can
 * know (whether settings fit each other) it says when it refuses a launch.
 */
import { count, significant } from '../lib/format'
import type { Field } from './layout'
import type { Problems } from './problems'
import { branches, type Json, range, resolve, type Schema, withoutNull } from './schema'
import { pathKey, valueAt } from './values'

/** Problems of all fields, by path. */
export function faultsOf(fields: readonly Field[], root: Schema, values: Json): Problems {
  const faults: Record<string, string> = {}
  for (const field of fields) {
    const value = valueAt(values, field.path) ?? null
    if (field.kind === 'terms') Object.assign(faults, termFaults(field, root, value))
    else {
      const fault = faultOf(field.schema, value, field.nullable)
      if (fault) faults[field.key] = fault
    }
  }
  return faults
}

/** Those of a list of objects of several kinds, each at its own setting. */
function termFaults(field: Field & { kind: 'terms' }, root: Schema, value: Json): Problems {
  const faults: Record<string, string> = {}
  const kinds = branches(field.item, root)
  const tag = field.item.discriminator?.propertyName ?? 'name'
  for (const [index, term] of (Array.isArray(value) ? value : []).entries()) {
    const kind = kinds.find((one) => one.tag === valueAt(term, [tag]))
    for (const [name, one] of Object.entries(kind?.schema.properties ?? {})) {
      const { schema, nullable } = withoutNull(resolve(one, root))
      const fault = name === tag ? undefined : faultOf(schema, valueAt(term, [name]) ?? null, nullable)
      if (fault) faults[pathKey([...field.path, index, name])] = fault
    }
  }
  return faults
}

/** What is wrong with one value, as a sentence; undefined if nothing is. */
export function faultOf(schema: Schema, value: Json, nullable = false): string | undefined {
  if (value === null && nullable) return undefined
  switch (schema.type) {
    case 'integer':
    case 'number':
      return numberFault(schema, value)
    case 'array':
      return listFault(schema, value)
    case 'string':
      return textFault(schema, value)
    default:
      return undefined
  }
}

function numberFault(schema: Schema, value: Json): string | undefined {
  const whole = schema.type === 'integer'
  if (value === null || value === '') return `A ${whole ? 'whole number' : 'number'} is missing.`
  if (typeof value !== 'number' || !Number.isFinite(value)) return `${JSON.stringify(value)} is no number.`
  if (whole && !Number.isInteger(value)) return 'It must be a whole number.'
  const { minimum, maximum, exclusiveMinimum, exclusiveMaximum } = schema
  const outside =
    (minimum !== undefined && value < minimum) ||
    (maximum !== undefined && value > maximum) ||
    (exclusiveMinimum !== undefined && value <= exclusiveMinimum) ||
    (exclusiveMaximum !== undefined && value >= exclusiveMaximum)
  return outside ? `It must be ${range(schema, whole ? count : significant)}.` : undefined
}

function listFault({ items, minItems = 0, maxItems }: Schema, value: Json): string | undefined {
  const list = Array.isArray(value) ? value : []
  if (list.length < minItems)
    return minItems === 1 ? 'One or more are missing.' : `It must be ${minItems} or more.`
  if (maxItems !== undefined && list.length > maxItems) return `It must be ${count(maxItems)} at most.`
  const fault = items && list.map((one) => faultOf(items, one)).find(Boolean)
  return fault?.replace(/^It /, 'Each ')
}

function textFault(schema: Schema, value: Json): string | undefined {
  const text = typeof value === 'string' ? value : ''
  if (schema['x-imported-arena'] && text === '') return 'Choose one of the imported arenas.'
  if (text.trim().length < (schema.minLength ?? 0)) return 'It must not be empty.'
  return undefined
}
