/** What lists and headings say about an experiment. */
import type { ListedExperiment, TrainingConfig } from '../api/types'
import { plural, words } from './format'

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
    reward: rewardName(task.reward),
  }
}

/** "Simple, 4 moving · Jackal · PPO, MLP · Basic reward". */
export function summaryOf(trained: Trained): string {
  const { arena, movers, robot, reward } = trained
  return [
    movers > 0 ? `${words(arena)}, ${movers} moving` : words(arena),
    ...(robot === USUAL_ROBOT ? [] : [words(robot)]),
    algorithmOf(trained),
    /^\d/.test(reward) ? `Reward of ${reward}` : `${words(reward)} reward`,
  ].join(' · ')
}

/** Which of the paper's rewards it is by its terms, whatever their weights, or how many terms it has. */
export function rewardName({ terms }: TrainingConfig['task']['reward']): string {
  const [progress, more, ...others] = terms.filter(({ name }) => name !== 'arrival' && name !== 'collision')
  if (progress?.name === 'progress' && others.length === 0) {
    if (!more && !progress.exponential) return 'basic'
    if (progress.exponential && (more?.name === 'clearance' || more?.name === 'alignment')) return more.name
  }
  return plural(terms.length, 'term')
}

/** "PPO, ResBlock". */
export function algorithmOf({ algorithm, network }: Trained): string {
  return `${words(algorithm)}, ${words(network)}`
}
