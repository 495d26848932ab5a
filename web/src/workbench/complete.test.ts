import { expect, test } from 'vitest'
import { completionAt, quoted } from './complete'
import { addressOf, DEFAULT_COLUMNS, nextSort, viewOf } from './view'

test.each([
  ['', 'key', '', '', 0],
  ['alg', 'key', '', 'alg', 0],
  ['state = failed gam', 'key', '', 'gam', 15],
  ['(-ta', 'key', '', 'ta', 2],
  ['algorithm = ', 'value', 'algorithm', '', 12],
  ['algorithm = pp', 'value', 'algorithm', 'pp', 12],
  ['state = running, qu', 'value', 'state', 'qu', 17],
  ['name = "two w', 'value', 'name', 'two w', 7],
  ['algorithm=s', 'value', 'algorithm', 's', 10],
])('what %j asks to be completed', (text, kind, key, part, start) => {
  expect(completionAt(text)).toEqual({ kind, key, part, start })
})

test('values are quoted where they must be', () => {
  expect([quoted('ppo'), quoted('64, 64'), quoted('')]).toEqual(['ppo', '"64, 64"', '""'])
})

test('a view survives its address', () => {
  const view = {
    query: 'gamma > 0.9 -tag = "old one"',
    project: 'p1',
    sort: 'algorithm.gamma',
    columns: ['state', 'train/return'],
    pinned: 1,
    by: 'algorithm',
    place: 'archived' as const,
  }
  expect(viewOf(new URLSearchParams(addressOf(view).toString()))).toEqual(view)
  expect(addressOf(viewOf(new URLSearchParams(''))).toString()).toBe('')
  expect(viewOf(new URLSearchParams('place=moon&pinned=x')).columns).toEqual(DEFAULT_COLUMNS)
})

test('a column sorts from the top, from the bottom, and not', () => {
  expect(nextSort('-created', 'name')).toBe('-name')
  expect(nextSort('-name', 'name')).toBe('name')
  expect(nextSort('name', 'name')).toBe('-created')
})
