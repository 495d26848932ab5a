import { expect, it } from 'vitest'
import type { Field } from './layout'
import { freshSearch, type Searched, searchFaults } from './search'

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

it('begins below 0 by ratio around a penalty, and with larger lists of sizes than the one that is set', () => {
  expect(freshSearch(number({}), -100)).toEqual({ kind: 'range', low: -1000, high: -10, log: true })
  const layers = {
    kind: 'numbers',
    key: 'training.x',
    schema: { type: 'array', minItems: 1, items: { type: 'integer', maximum: 1024 } },
  } as unknown as Field
  expect(freshSearch(layers, [512])).toEqual({ kind: 'list', values: [[512], [1024]] })
})

it('says what is wrong with a range and with a list before they are sent', () => {
  const fault = (searched: Searched, field = number({ type: 'number', maximum: 10 })) =>
    searchFaults([{ field, searched }])['training.x']
  const range = (low: number | string, high: number, log = false): Searched => ({
    kind: 'range',
    low,
    high,
    log,
  })
  expect(fault(range(1, 20))).toBe('It must be at most 10.')
  expect(fault(range('', 2))).toBe('A number is missing.')
  expect(fault(range(2, 2))).toBe('It must begin below its end.')
  expect(fault(range(-1, 2, true))).toBe('On a logarithmic scale it must keep to one side of 0.')
  expect(fault(range(-2, -1, true))).toBeUndefined()
  const choice = { kind: 'choice', key: 'training.x', schema: {} } as Field
  expect(fault({ kind: 'list', values: ['linear'] }, choice)).toBe('Choose two or more.')
  const layers = { kind: 'numbers', key: 'training.x', schema: { type: 'array', minItems: 1 } } as Field
  expect(fault({ kind: 'list', values: [[64], [64]] }, layers)).toBe('Each only once.')
  expect(fault({ kind: 'list', values: [[64], []] }, layers)).toBe('One or more are missing.')
})

it('begins near the end that a discount comes close to', () => {
  // 0.005 are left: ten times as much to a tenth of it.
  const discount = number({ exclusiveMinimum: 0, maximum: 1 })
  expect(freshSearch(discount, 0.995)).toEqual({ kind: 'range', low: 0.95, high: 0.9995, log: false })
  expect(freshSearch(discount, 0.9)).toEqual({ kind: 'range', low: 0.5, high: 0.99, log: false })
})
