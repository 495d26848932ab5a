import { expect, test } from 'vitest'
import { compact, duration, NARROW_SPACE, percent, significant } from '../lib/format'
import { alike, choices, factors, fitted, numbers, rounds } from './axis'

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

/** With the narrow spaces of the pages. */
const narrow = (texts: readonly string[]) => texts.map((text) => text.replaceAll(' ', NARROW_SPACE))

test('the ticks of an axis are written alike', () => {
  expect(alike([0, 0.25, 0.5, 0.75, 1], significant)).toEqual(['0.00', '0.25', '0.50', '0.75', '1.00'])
  expect(alike([-0.5, 0, 0.5], significant)).toEqual(['−0.5', '0.0', '0.5'])
  expect(alike([0, 0.1 + 0.2, 0.6], significant)).toEqual(['0.0', '0.3', '0.6'])
  expect(alike([0, 0.5, 1], percent)).toEqual(narrow(['0 %', '50 %', '100 %']))
  expect(alike([0.95, 0.975, 1], percent)).toEqual(narrow(['95.0 %', '97.5 %', '100.0 %']))
  // What lies beyond is written as it is, not as 99.9.
  expect(alike([0.99, 1, 1.01], percent)).toEqual(narrow(['99 %', '100 %', '101 %']))
})

test('ticks have the unit of the largest, and tell apart what lies close together', () => {
  expect(alike([0, 500, 1_000, 1_500], compact)).toEqual(['0', '0.5k', '1.0k', '1.5k'])
  expect(alike([-500, 0, 500], compact)).toEqual(['−500', '0', '500'])
  expect(alike([1_234_000, 1_234_500, 1_235_000], compact)).toEqual(['1.2340M', '1.2345M', '1.2350M'])
  expect(alike([0, 5_000, 10_000], significant)).toEqual(narrow(['0', '5 000', '10 000']))
  expect(alike([0, 2e-5, 1.5e-5], significant)).toEqual(['0', '2.0e−5', '1.5e−5'])
})

test('one tick, none, and such as have no unit in common', () => {
  expect(alike([], significant)).toEqual([])
  expect(alike([0], significant)).toEqual(['0'])
  expect(alike([12.5], significant)).toEqual(['12.5'])
  expect(alike([0, 1_800, 5_400], duration)).toEqual(['0 s', '30 min', '1 h 30 min'])
})
