import { expect, test } from 'vitest'
import type { Series } from '../api/types'
import { ACROSS, placed } from './across'

const series = (name: string, points: Record<number, number | null>): Series => ({
  name,
  steps: Object.keys(points).map(Number),
  values: Object.values(points),
  min: null,
  max: null,
})
const of = (found: readonly Series[] | null, name: string) => found?.find((one) => one.name === name)

test('time under way does not stretch over the night in which a run was stopped', () => {
  // Stopped at step 200 after 20 s, resumed ten hours later from there: 100 more steps in 15 s.
  const run = [
    series('time/wall_seconds', { 100: 10, 200: 20, 300: 35 }),
    series('train/return', { 100: 1, 200: 2, 300: 3 }),
  ]
  expect(of(placed(run, 'wall'), 'train/return')).toMatchObject({ steps: [10, 20, 35], values: [1, 2, 3] })
})

test('a point between two reports lies between their counts, and one beyond them nowhere', () => {
  const run = [
    series('time/cpu_seconds', { 100: 10, 200: 30 }),
    series('eval/steps', { 50: 1, 100: 2, 125: 3, 200: 4, 250: 5 }),
  ]
  expect(of(placed(run, 'cpu'), 'eval/steps')).toMatchObject({ steps: [10, 15, 30], values: [2, 3, 4] })
})

test('of points that were taken together the count at their last step is the highest, and bands move along', () => {
  const run: Series[] = [
    { name: 'train/episodes', steps: [200, 400], values: [7, 22], min: [4, 15], max: [10, 30] },
    { name: 'train/return', steps: [200, 400], values: [1, 2], min: [0, 1], max: [2, 3] },
  ]
  expect(of(placed(run, 'episodes'), 'train/return')).toEqual({
    name: 'train/return',
    steps: [10, 30],
    values: [1, 2],
    min: [0, 1],
    max: [2, 3],
  })
})

test('of several points at one count the newest stands', () => {
  const run = [
    series('train/episodes', { 100: 0, 200: 0, 300: 4 }),
    series('train/reward', { 100: 1, 200: 2, 300: 3 }),
  ]
  expect(of(placed(run, 'episodes'), 'train/reward')).toMatchObject({ steps: [0, 4], values: [2, 3] })
})

test('what was not counted is not known', () => {
  const run = [series('train/return', { 100: 1 })]
  expect(placed(run, 'wall')).toBeNull()
  expect(placed(run, 'steps')).toBe(run)
})

test('times are written as people say them', () => {
  expect([0.25, 45, 200, 7_500].map(ACROSS.wall.format)).toEqual([
    '0.25 s',
    '45 s',
    '3 min 20 s',
    '2 h 5 min',
  ])
})
