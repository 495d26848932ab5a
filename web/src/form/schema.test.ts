import { expect, test } from 'vitest'
import { fieldsOf } from './layout'
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
