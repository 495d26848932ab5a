import { expect, test } from 'vitest'
import type { TrainingConfig } from '../api/types'
import { training } from '../testing/examples'
import { inShort, summaryOf } from './experiments'

const changed = (task: object): TrainingConfig => ({ ...training, task: { ...training.task, ...task } })

test('a summary names arena, algorithm and reward, and the robot where it is not the usual one', () => {
  expect(summaryOf(inShort(training))).toBe('Simple · PPO, MLP · Basic reward')
  expect(summaryOf(inShort(changed({ robot: { name: 'jackal' } })))).toBe(
    'Simple · Jackal · PPO, MLP · Basic reward',
  )
})
