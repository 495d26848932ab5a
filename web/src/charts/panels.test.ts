import { expect, test } from 'vitest'
import { percent } from '../lib/format'
import { lookOf, MOST_PANELS, panelsOf, USUAL_PANELS } from './panels'

test('a metric looks as in its chart on a run, and its name tells it from its neighbours', () => {
  expect(lookOf('train/return')).toMatchObject({ title: 'Return', note: 'per episode, training' })
  expect(lookOf('loss/value')).toMatchObject({ title: 'Value loss', note: 'loss/value', smoothable: true })
  expect(lookOf('eval/collision_rate')).toMatchObject({
    title: 'How episodes end: collision',
    note: 'eval/collision_rate',
    format: percent,
  })
  expect(lookOf('train/collision_rate').note).toBe('train/collision_rate')
})

test('a metric that no chart of ours knows is called by its name', () => {
  expect(lookOf('reward/my_own_term')).toMatchObject({
    title: 'Reward: my own term',
    note: 'reward/my_own_term',
  })
  expect(lookOf('mine/miss_rate')).toMatchObject({
    title: 'mine/miss_rate',
    format: percent,
    smoothable: true,
  })
  expect(lookOf('optim/other_learning_rate').yRange).toBeUndefined()
})

test('an address cannot ask for more panels than a page draws', () => {
  expect(panelsOf([])).toBeNull()
  expect(panelsOf(['', 'x'.repeat(65)])).toBeNull()
  expect(panelsOf(['a', 'b', 'a'])).toEqual(['a', 'b'])
  expect(panelsOf(Array.from({ length: 500 }, (_, index) => `m/${index}`))).toHaveLength(MOST_PANELS)
  expect(new Set(USUAL_PANELS.map((name) => `${lookOf(name).title} ${lookOf(name).note}`)).size).toBe(4)
})
