import { expect, test } from 'vitest'
import type { Curves, Metrics, Series } from '../api/types'
import { follow, followed, followedCurves, newest } from './following'

const series = (name: string, steps: number[], values: number[], band?: [number[], number[]]): Series => ({
  name,
  steps,
  values,
  min: band?.[0] ?? null,
  max: band?.[1] ?? null,
})
const answer = (since: number | null, ...all: Series[]): Metrics => ({
  series: all,
  attempt: 1,
  thinned: null,
  since,
})

test('what is known gives way from the step on that the news begins with', () => {
  const known = answer(null, series('a', [10, 20, 30], [1, 2, 3]), series('rare', [20], [9]))
  const news = answer(30, series('a', [30, 40], [3.5, 4]), series('late', [40], [7]))
  expect(followed(known, news)).toEqual(
    answer(
      30,
      series('a', [10, 20, 30, 40], [1, 2, 3.5, 4]),
      series('late', [40], [7]),
      series('rare', [20], [9]),
    ),
  )
})

test('points that were taken together keep their band, and single ones are a band of no width', () => {
  const known = answer(
    null,
    series(
      'a',
      [100, 110],
      [2, 5],
      [
        [1, 5],
        [3, 5],
      ],
    ),
  )
  const news = answer(110, series('a', [110, 120], [5, 6]))
  expect(followed(known, news).series).toEqual([
    series(
      'a',
      [100, 110, 120],
      [2, 5, 6],
      [
        [1, 5, 6],
        [3, 5, 6],
      ],
    ),
  ])
})

test('an answer that is whole stands for itself', () => {
  const whole = { ...answer(null, series('a', [1], [1])), attempt: 2 }
  expect(followed(answer(null, series('a', [1, 2, 3], [1, 2, 3])), whole)).toBe(whole)
})

test('the newest step of all series, until one has grown too long', () => {
  expect(newest(undefined, 2)).toBeUndefined()
  expect(newest(answer(null), 2)).toBeUndefined()
  expect(newest(answer(null, series('a', [10, 40], [1, 1]), series('b', [30], [1])), 2)).toBe(40)
  expect(newest(answer(null, series('a', [1, 2, 3, 4, 5], [1, 1, 1, 1, 1])), 2)).toBeUndefined()
})

const curves = (steps: number[], values: number[], since: number | null = null): Curves => ({
  name: 'train/return',
  across: 'steps',
  spacing: 'points',
  steps,
  x: null,
  since,
  follow: 'token',
  experiments: [
    {
      id: 'e',
      name: 'Corridor',
      seeds: [{ seed: 0, values, thinned: false }],
      mean: values,
      low: values,
      high: values,
      count: values.map(() => 1),
      unplaced: 0,
    },
  ],
})

test("a comparison's places beyond the last settled one give way to the news", () => {
  const known = curves([10, 20, 30], [1, 2, 3])
  expect(followedCurves(known, curves([25, 40], [2.5, 4], 20))).toEqual(
    curves([10, 20, 25, 40], [1, 2, 2.5, 4], 20),
  )
  expect(followedCurves(known, curves([], [], 30))).toEqual(curves([10, 20, 30], [1, 2, 3], 30))
  expect(followedCurves(known, curves([1], [9]))).toEqual(curves([1], [9]))
})

test('a comparison is asked for anew once it has grown to twice its width, or cannot be followed', () => {
  expect(follow(undefined, 2)).toBeUndefined()
  expect(follow(curves([1, 2, 3, 4], [1, 2, 3, 4]), 2)).toBe('token')
  expect(follow(curves([1, 2, 3, 4, 5], [1, 2, 3, 4, 5]), 2)).toBeUndefined()
  expect(follow({ ...curves([1], [1]), follow: null }, 2)).toBeUndefined()
})
