import { expect, test } from 'vitest'
import { compact, percent } from '../lib/format'
import { axisOf, MAIN_CHARTS, SECTIONS } from './metrics'
import { grouped, lookOf, MOST_PANELS, OTHERS, panelsOf } from './panels'
import { metricText, NAMED, wordsOf } from './words'

test('a metric is called by its words, and drawn as in its chart on a run', () => {
  expect(lookOf('train/return')).toEqual({
    title: 'Return',
    note: 'per episode, training',
    y: 'Return per episode',
    smoothable: true,
  })
  expect(lookOf('eval/collision_rate')).toMatchObject({
    title: 'Collision rate',
    note: 'evaluation',
    y: 'Share of episodes',
    format: percent,
    smoothable: false,
  })
  expect(lookOf('policy/entropy').smoothable).toBe(false)
  expect(lookOf('time/steps_per_second').format).toBe(compact)
})

test('a metric that no chart of ours knows is called by its name', () => {
  expect(lookOf('reward/my_own_term')).toMatchObject({ title: 'Reward: my own term', y: 'Reward per step' })
  expect(lookOf('mine/miss_rate')).toMatchObject({
    title: 'mine/miss_rate',
    y: 'mine/miss_rate',
    format: percent,
    smoothable: true,
  })
  expect(lookOf('optim/other_learning_rate').yRange).toBeUndefined()
})

test('no two metrics have the same words', () => {
  expect(new Set(NAMED.map(metricText)).size).toBe(NAMED.length)
})

test('every metric of a chart has words, and what the chart says of its axis holds for all of them', () => {
  for (const spec of [...MAIN_CHARTS, ...SECTIONS.flatMap(({ charts }) => charts)]) {
    for (const { name } of spec.metrics) {
      expect(NAMED, name).toContain(name)
      expect(wordsOf(name).axis, name).toBe(axisOf(spec))
      expect(wordsOf(name).share ?? false, name).toBe(spec.format === percent)
    }
    expect(axisOf(spec)).not.toContain('/')
  }
})

test('metrics stand in the sections of a run, with their kin; what has no words comes last', () => {
  expect(
    grouped([
      'mine/bumps',
      'eval/return',
      'policy/temperature',
      'reward/progress',
      'train/spin',
      'train/return',
      'own',
    ]),
  ).toEqual([
    { group: 'Episodes', names: ['reward/progress', 'train/return'] },
    { group: 'Learning', names: ['policy/temperature'] },
    { group: 'Behaviour', names: ['train/spin'] },
    { group: 'Evaluation', names: ['eval/return'] },
    { group: OTHERS, names: ['mine/bumps', 'own'] },
  ])
})

test('an address cannot ask for more panels than a page draws', () => {
  expect(panelsOf([])).toBeNull()
  expect(panelsOf(['', 'x'.repeat(65)])).toBeNull()
  expect(panelsOf(['a', 'b', 'a'])).toEqual(['a', 'b'])
  expect(panelsOf(Array.from({ length: 500 }, (_, index) => `m/${index}`))).toHaveLength(MOST_PANELS)
})
