import { expect, test } from 'vitest'
import { curves } from '../testing/examples'
import { MAIN_CHARTS, SECTIONS } from './metrics'
import { colorOf } from './palette'
import { aboveZero, alignSeries, allPositive, lastValue, readAt, smooth, smoothed } from './series'
import { chartOf, chartOfCurves } from './shape'

test('series of different steps share one x, with gaps where they have no point', () => {
  const aligned = alignSeries([
    { steps: [10, 20, 30], values: [1, 2, 3] },
    { steps: [15, 30], values: [7, null] },
  ])
  expect(aligned.x).toEqual([10, 15, 20, 30])
  expect(aligned.values).toEqual([
    [1, null, 2, 3],
    [null, 7, null, null],
  ])
})

test('smoothing starts at the first value and skips gaps', () => {
  // With weight 0.5 the averages are 2, then 0.5 * 2 + 0.5 * 8 = 5, over the norms 0.5, then 0.75.
  expect(smooth([4, null, 8], 0.5)).toEqual([4, null, 5 / 0.75])
  expect(smooth([1, 2], 0)).toEqual([1, 2])
})

test('a constant stays a constant under smoothing', () => {
  for (const value of smooth([3, 3, 3, 3], 0.85)) expect(value).toBeCloseTo(3)
})

test('what a legend reads', () => {
  expect(lastValue([1, 2, null])).toBe(2)
  expect(lastValue([])).toBeNull()
  expect(readAt([0, 10, 20], [1, null, 3], 9, [0, 20])).toBe(1)
  expect(readAt([0, 10, 20], [1, null, 3], 11, [0, 20])).toBe(3)
})

test('nothing is read beyond the ends of a curve, but what is as good as pointed at', () => {
  const x = [0, 10, 20, 30]
  const values = [null, 2, 3, null]
  expect([9, 10, 20, 21].map((place) => readAt(x, values, place, [0, 30]))).toEqual([null, 2, 3, null])
  expect(readAt(x, values, 9, [0, 30], [8, 10])).toBe(2)
  expect(readAt(x, values, 22, [0, 30], [21, 23])).toBeNull()
})

test('what is read lies within what is seen', () => {
  const x = [0, 57_344]
  expect(readAt(x, [null, 1], 25_700, [19_000, 36_000])).toBeNull()
  expect(readAt(x, [0, 1], 25_700, [19_000, 36_000])).toBeNull()
  expect(readAt([0, 20_000, 57_344], [0, 0.4, 1], 50_000, [19_000, 56_000])).toBe(0.4)
})

test('a smoothed line keeps its raw values beneath it and for whoever reads it, a seed as well as a mean', () => {
  const line = { key: 'a', label: 'one', color: 2, values: [4, 8], band: { low: [3, 7], high: [5, 9] } }
  const seed = { key: 'a:0', color: 2, thin: true, values: [4, 8] }
  const soft = [4, 5 / 0.75]
  expect(smoothed({ x: [1, 2], lines: [seed, line] }, 0.5).lines).toEqual([
    { ...seed, key: 'a:0:raw', faint: true },
    { ...seed, values: [4, 5 / 0.75], raw: [4, 8] },
    { key: 'a:raw', color: 2, values: [4, 8], thin: true },
    { key: 'a', label: 'one', color: 2, values: soft, raw: [4, 8] },
  ])
  expect(smoothed({ x: [1, 2], lines: [line] }, 0).lines).toEqual([line])
})

test('zero and below have no logarithm', () => {
  expect(allPositive([{ key: 'a', color: 0, values: [1, null, 0.1] }])).toBe(true)
  expect(allPositive([{ key: 'a', color: 0, values: [1, 0] }])).toBe(false)
})

test('a logarithmic x has a place for what lies above 0, with its band', () => {
  const line = { key: 'a', color: 0, values: [1, 2, 3], band: { low: [0, 1, 2], high: [2, 3, 4] } }
  const data = { x: [0, 10, 20], lines: [line] }
  expect(aboveZero(data)).toEqual({
    x: [10, 20],
    lines: [{ key: 'a', color: 0, values: [2, 3], band: { low: [1, 2], high: [3, 4] } }],
  })
  expect(aboveZero({ ...data, x: [1, 10, 20] })).toEqual({ ...data, x: [1, 10, 20] })
  expect(aboveZero({ x: [0], lines: [{ ...line, values: [1], band: { low: [0], high: [1] } }] }).x).toEqual(
    [],
  )
})

test('a chart of a run shows the series that have points, each with a colour of its own', () => {
  const [spec] = MAIN_CHARTS
  if (!spec) throw new Error('no chart')
  const data = chartOf(spec, [
    { name: 'eval/success_rate', steps: [50], values: [0.4], min: null, max: null },
    { name: 'train/return', steps: [1], values: [1], min: null, max: null },
  ])
  expect(data.x).toEqual([50])
  expect(data.lines).toEqual([{ key: 'eval/success_rate', label: 'evaluation', color: 1, values: [0.4] }])
})

test('experiments together: seeds thin, mean bold with its band, N in the legend', () => {
  const { x, lines } = chartOfCurves(curves)
  expect(x).toEqual([0, 100, 200])
  expect(lines.map(({ key, label, thin, color }) => [key, label, thin ?? false, color])).toEqual([
    ['exp1:0', undefined, true, colorOf('exp1')],
    ['exp1:1', undefined, true, colorOf('exp1')],
    ['exp1', 'Corridor, 2 seeds', false, colorOf('exp1')],
    ['exp2', 'Alone, 1 seed', false, colorOf('exp2')],
  ])
  expect(lines[2]?.band?.low).toEqual([0.1, 0.5, null])
  expect(lines[3]?.band).toBeUndefined()
})

test('a mean that ends before its seeds do says where', () => {
  const [corridor, ...others] = curves.experiments
  if (!corridor) throw new Error('no experiment')
  const slow = { ...corridor, mean: [0.2, 0.4, null], count: [2, 2, 1] }
  const { lines } = chartOfCurves({ ...curves, experiments: [slow, ...others] })
  expect(lines.map(({ key, until }) => [key, until])).toContainEqual(['exp1', 100])
  const together = { ...slow, count: [2, 2, 0] }
  expect(chartOfCurves({ ...curves, experiments: [together] }).lines[2]?.until).toBeUndefined()
})

test('an experiment without a value has no line, and no chart without lines has an x', () => {
  const nothing = curves.experiments.map((one) => ({ ...one, count: [0, 0, 0] }))
  expect(chartOfCurves({ ...curves, experiments: nothing })).toEqual({ x: [], lines: [] })
})

test('every metric that a training reports is in some chart', () => {
  const shown = [...MAIN_CHARTS, ...SECTIONS.flatMap((section) => section.charts)].flatMap((chart) =>
    chart.metrics.map((metric) => metric.name),
  )
  for (const name of [
    'loss/policy',
    'loss/value',
    'policy/kl',
    'policy/entropy',
    'train/reward',
    'time/update',
  ])
    expect(shown).toContain(name)
})

test('a series whose points were taken together has a band from the smallest to the largest', () => {
  const spec = { title: 'Loss', metrics: [{ name: 'loss/policy', label: 'loss' }] }
  const cut = { name: 'loss/policy', steps: [10, 20], values: [2, 3], min: [1, 3], max: [4, 3] }
  expect(chartOf(spec, [cut]).lines[0]?.band).toEqual({ low: [1, 3], high: [4, 3] })
  expect(chartOf(spec, [{ ...cut, min: null, max: null }]).lines[0]?.band).toBeUndefined()
})

test('every term of a reward has a line, one’s own formulas among them', () => {
  const spec = { title: 'Reward terms', metrics: [], prefix: 'reward/' }
  const one = (name: string) => ({ name, steps: [10], values: [2], min: null, max: null })
  const { lines } = chartOf(spec, ['train/reward', 'reward/progress', 'reward/slow_near'].map(one))
  expect(lines.map(({ key, label, color }) => [key, label, color])).toEqual([
    ['reward/progress', 'progress', 0],
    ['reward/slow_near', 'slow near', 1],
  ])
})
