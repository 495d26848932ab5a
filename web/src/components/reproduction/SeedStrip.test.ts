import { expect, test } from 'vitest'
import { lanesOf } from './SeedStrip'

test('seeds that would cover one another stand in lanes above one another', () => {
  expect(lanesOf([0.9, 0.9, 0.5, 0.92, 0.96])).toEqual([0, 1, 0, 2, 0])
})

test('a seed that is not done takes no room', () => {
  expect(lanesOf([null, 1, null, 1])).toEqual([0, 0, 0, 1])
})
