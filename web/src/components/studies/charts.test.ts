import { expect, test } from 'vitest'
import { history, measured, successAxis } from './charts'
import type { Study } from './study'

const trial = (number: number, some: object) => ({
  number,
  state: 'complete',
  values: {},
  experiment_id: null,
  progress: 1,
  success: null,
  seconds_to_target: null,
  cost: null,
  rungs: {},
  reason: null,
  ...some,
})

const study = (...results: object[]) => ({ results, best: 1, spec: { settings: [] } }) as unknown as Study

const searched = study(
  trial(1, { success: 0.9 }),
  trial(2, { state: 'pruned', rungs: { 4000: 0.5, 16000: 0.95 } }),
  trial(3, { state: 'running', rungs: { 4000: 0.7 } }),
  trial(4, { success: 0.98 }),
)

test('a trial that was stopped early stands where it was measured last, one that goes on nowhere yet', () => {
  expect(measured(searched).map(({ number, success }) => [number, success])).toEqual([
    [1, 0.9],
    [2, 0.95],
    [4, 0.98],
  ])
})

test('it is grey, said to be stopped, and never the best until then', () => {
  const { points, line } = history({ study: searched, titles: [] })
  expect(points.map(({ color }) => color === null)).toEqual([false, true, false])
  expect(points[1]?.title).toMatch(/^Trial 2: 95\.0\s%, stopped early after 16\s000 steps/)
  expect(line).toEqual([
    [1, 0.9],
    [2, 0.9],
    [4, 0.98],
  ])
})

test('what is all between 90 and 98 % fills its axis; what is not begins at 0', () => {
  const low = (one: Study) => successAxis(one).ticks[0]?.label
  expect(low(searched)).toMatch(/^80\s%$/)
  expect(successAxis(searched).place(0.9)).toBeCloseTo(0.5)
  expect(low(study(trial(1, { success: 0.3 }), trial(2, { success: 0.98 })))).toMatch(/^0\s%$/)
})
