import { expect, test } from 'vitest'
import { fieldsOf, initialOf } from './layout'
import { branches, defaults, type Schema } from './schema'

const ROOT: Schema = {
  $defs: {
    Generated: {
      properties: {
        name: { enum: ['rooms', 'maze'], default: 'rooms', title: 'Arena' },
        difficulty: { type: 'number', default: 0.5 },
      },
    },
    Imported: {
      properties: {
        name: { const: 'imported', default: 'imported', title: 'From a file' },
        geometry: { type: 'string', default: '', 'x-hidden': true },
      },
    },
  },
}

const ARENA: Schema = {
  discriminator: {
    propertyName: 'name',
    mapping: { imported: '#/$defs/Imported', maze: '#/$defs/Generated', rooms: '#/$defs/Generated' },
  },
  oneOf: [{ $ref: '#/$defs/Generated' }, { $ref: '#/$defs/Imported' }],
}

test('a model with several tags is a branch for each, in its own order, and starts with that tag', () => {
  const all = branches(ARENA, ROOT)
  expect(all.map(({ tag, label }) => [tag, label])).toEqual([
    ['rooms', 'Rooms'],
    ['maze', 'Maze'],
    ['imported', 'From a file'],
  ])
  expect(all.map(({ schema }) => defaults(schema, ROOT))).toEqual([
    { name: 'rooms', difficulty: 0.5 },
    { name: 'maze', difficulty: 0.5 },
    { name: 'imported', geometry: '' },
  ])
})

test('what a program fills in is no field', () => {
  const form: Schema = { ...ROOT, properties: { arena: ARENA } }
  const keys = (name: string) => fieldsOf(form, form, { arena: { name } }).map(({ key }) => key)
  expect(keys('maze')).toEqual(['arena', 'arena.difficulty'])
  expect(keys('imported')).toEqual(['arena'])
})

test('a field of another kind than the fresh form has goes back to its own default', () => {
  const robot = (speed: number, name: string): Schema => ({
    properties: {
      name: { const: name, default: name },
      speed: { type: 'number', default: speed },
    },
  })
  const root: Schema = {
    $defs: { Small: robot(0.25, 'small'), Large: robot(2, 'large') },
    properties: {
      name: { type: 'string' },
      robot: {
        discriminator: {
          propertyName: 'name',
          mapping: { small: '#/$defs/Small', large: '#/$defs/Large' },
        },
        oneOf: [{ $ref: '#/$defs/Small' }, { $ref: '#/$defs/Large' }],
      },
    },
  }
  const initial = { name: '', robot: { name: 'small', speed: 0.3 } }
  const fresh = (name: string) => {
    const values = { name: 'Mine', robot: { name, speed: 1 } }
    return fieldsOf(root, root, values).map((field) => initialOf(field, values, initial))
  }
  expect(fresh('small')).toEqual(['', initial.robot, 0.3])
  expect(fresh('large')).toEqual(['', initial.robot, 2])
})

test('what changes nothing without its neighbour is no field while that is 0', () => {
  const form: Schema = {
    properties: {
      count: { type: 'integer', default: 0 },
      speed: { type: 'number', default: 1, 'x-needs': 'count' },
    },
  }
  const keys = (count: number) => fieldsOf(form, form, { count, speed: 1 }).map(({ key }) => key)
  expect(keys(0)).toEqual(['count'])
  expect(keys(2)).toEqual(['count', 'speed'])
})
