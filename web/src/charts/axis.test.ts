import { expect, test } from 'vitest'
import { choices, factors, fitted, numbers, rounds } from './axis'

test('an axis of numbers has round ticks within its ends', () => {
  expect(rounds(0, 1)).toEqual([0, 0.2, 0.4, 0.6, 0.8, 1])
  expect(rounds(0.95, 0.999)).toEqual([0.95, 0.96, 0.97, 0.98, 0.99])
  const axis = numbers([2, 12], String)
  expect(axis.ticks.map(({ label }) => label)).toEqual(['2', '4', '6', '8', '10', '12'])
  expect(axis.place(7)).toBeCloseTo(0.5)
})

test('a logarithmic axis has powers of ten, or 1, 2 and 5 of one where those are fewer than two', () => {
  const axis = numbers([1e-4, 1e-2], String, { log: true })
  expect(axis.ticks.map(({ label }) => label)).toEqual(['0.0001', '0.001', '0.01'])
  expect(axis.place(1e-3)).toBeCloseTo(0.5)
  expect(numbers([2, 8], String, { log: true }).ticks.map(({ label }) => label)).toEqual(['2', '5'])
  // Penalties: -100 is half-way from -1000 to -10 by ratio.
  const below = numbers([-1000, -10], String, { log: true })
  expect([-1000, -100, -10].map(below.place)).toEqual([0, expect.closeTo(0.5), 1])
  expect(below.ticks.map(({ label }) => label).sort()).toEqual(['-10', '-100', '-1000'])
  expect(factors(300, 40_000)).toEqual([1_000, 10_000])
  expect(factors(1e-12, 1e12)).toEqual([1e-12, 1e-7, 1e-2, 1e3, 1e8])
  expect(factors(6, 8)).toEqual([6, 6.5, 7, 7.5, 8])
  expect(factors(6, 6)).toEqual([6])
})

test('a logarithmic axis ends close to its values, not at the next powers of ten', () => {
  // 2^(1/20) of a factor of two.
  expect(fitted(0.3, 0.6)[0]).toBeCloseTo(0.28978)
  expect(fitted(0.3, 0.6)[1]).toBeCloseTo(0.62116)
  expect(fitted(5, 5)).toEqual([5 / 1.01, 5 * 1.01])
})

test('where all values are one, or there are none, they lie in the middle', () => {
  expect(numbers([3, 3], String).place(3)).toBe(0.5)
  expect(numbers([], String)).toMatchObject({ ticks: [] })
})

test('choices lie side by side in their order', () => {
  const axis = choices(['linear', 'constant'], String)
  expect([axis.place('linear'), axis.place('constant')]).toEqual([0.25, 0.75])
})
