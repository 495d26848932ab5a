import { expect, test } from 'vitest'
import type { TrainingConfig } from '../api/types'
import { training } from '../testing/examples'
import { inShort, rewardName, suggestedName, summaryOf } from './experiments'

const changed = (task: object): TrainingConfig => ({ ...training, task: { ...training.task, ...task } })

test('a summary names arena, algorithm and reward, and the robot where it is not the usual one', () => {
  expect(summaryOf(inShort(training))).toBe('Simple · PPO, MLP · Basic reward')
  expect(summaryOf(inShort(changed({ robot: { name: 'jackal' } })))).toBe(
    'Simple · Jackal · PPO, MLP · Basic reward',
  )
})

test('a reward goes by the name of the paper’s, or by how many terms it has', () => {
  const [arrival, progress] = training.task.reward.terms
  const named = (terms: unknown[]) => rewardName({ terms } as typeof training.task.reward)
  expect(named([arrival, { ...progress, exponential: true }, { name: 'alignment', weight: -5 }])).toBe(
    'alignment',
  )
  expect(named([arrival, progress, { name: 'time', weight: -1 }])).toBe('3 terms')
  expect(named([arrival])).toBe('1 term')
})

test('a name is suggested from what is trained where', () => {
  expect(suggestedName(training as never)).toBe('PPO, simple')
  const task = { arena: { name: 'imported', movers: { count: 4 } }, robot: { name: 'jackal' } }
  expect(suggestedName({ algorithm: { name: 'sac' }, task }, 'Lab')).toBe('SAC, Lab, 4 moving, Jackal')
  expect(suggestedName(null)).toBe('Training')
})
