import { expect, it } from 'vitest'
import type { Field } from './layout'
import { freshSearch } from './search'

const number = (schema: object): Field =>
  ({ kind: 'number', key: 'training.x', integer: false, nullable: true, schema }) as Field

it('begins a range around the value that is set', () => {
  const std = number({ exclusiveMinimum: 0.01, maximum: 2 })
  expect(freshSearch(std, 0.2)).toEqual({ kind: 'range', low: 0.02, high: 2, log: true })
})

it('begins with the middle half of what may be where nothing is set', () => {
  // 0.02 to 2 are two tens: a quarter of them is 10^0.5 = 3.16.
  const std = number({ exclusiveMinimum: 0.02, maximum: 2 })
  expect(freshSearch(std, null)).toEqual({ kind: 'range', low: 0.063, high: 0.63, log: true })
  const clearance = number({ exclusiveMinimum: 0, maximum: 1 })
  expect(freshSearch(clearance, null)).toEqual({ kind: 'range', low: 0.25, high: 0.75, log: false })
})

it('begins near the end that a discount comes close to', () => {
  // 0.005 are left: ten times as much to a tenth of it.
  const discount = number({ exclusiveMinimum: 0, maximum: 1 })
  expect(freshSearch(discount, 0.995)).toEqual({ kind: 'range', low: 0.95, high: 0.9995, log: false })
  expect(freshSearch(discount, 0.9)).toEqual({ kind: 'range', low: 0.5, high: 0.99, log: false })
})
