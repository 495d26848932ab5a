/** What lists and headings say about an experiment. */
import type { ListedExperiment, TrainingConfig } from '../api/types'
import { words } from './format'

/** What nobody needs to be told: the robot that everybody starts with. */
const USUAL_ROBOT = 'burger'

/** What is trained, in the words of a list. */
export type Trained = Pick<
  ListedExperiment,
  'arena' | 'movers' | 'robot' | 'algorithm' | 'network' | 'reward'
>

/** A whole configuration in the words of a list. */
export function inShort({ task, algorithm }: TrainingConfig): Trained {
  return {
    arena: task.arena.name,
    movers: task.arena.movers.count,
    robot: task.robot.name,
    algorithm: algorithm.name,
    network: algorithm.network.name,
    reward: task.reward.name,
  }
}

/** "Simple, 4 moving · Jackal · PPO, MLP · Basic reward". */
export function summaryOf(trained: Trained): string {
  const { arena, movers, robot, reward } = trained
  return [
    movers > 0 ? `${words(arena)}, ${movers} moving` : words(arena),
    ...(robot === USUAL_ROBOT ? [] : [words(robot)]),
    algorithmOf(trained),
    `${words(reward)} reward`,
  ].join(' · ')
}

/** "PPO, ResBlock". */
export function algorithmOf({ algorithm, network }: Trained): string {
  return `${words(algorithm)}, ${words(network)}`
}
