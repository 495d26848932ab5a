/** What lists and headings say about an experiment. */
import type { ListedExperiment, TrainingConfig } from '../api/types'
import type { Json } from '../form/schema'
import { valueAt } from '../form/values'
import { plural, words } from './format'

/** What nobody needs to be told: the robot that everybody starts with. */
const USUAL_ROBOT = 'burger'

/** What is trained, in the words of a list. */
export type Trained = Pick<
  ListedExperiment,
  'arena_title' | 'movers' | 'robot' | 'algorithm' | 'network' | 'reward'
>

/** A whole configuration in the words of a list; an imported arena's name is to be given. */
export function inShort({ task, algorithm }: TrainingConfig, arena = words(task.arena.name)): Trained {
  return {
    arena_title: arena,
    movers: task.arena.movers.count,
    robot: task.robot.name,
    algorithm: algorithm.name,
    network: algorithm.network.name,
    reward: rewardName(task.reward),
  }
}

/** "Simple, 4 moving · Jackal · PPO, MLP · Basic reward". */
export function summaryOf(trained: Trained): string {
  const { arena_title: arena, movers, robot, reward } = trained
  return [
    movers > 0 ? `${arena}, ${movers} moving` : arena,
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

/** "PPO, rooms, 4 moving": a name for a training from its settings, as far as they can be read. */
export function suggestedName(training: Json, arena?: string): string {
  const at = (...path: string[]) => valueAt(training, path)
  const movers = at('task', 'arena', 'movers', 'count')
  const robot = at('task', 'robot', 'name')
  const place = arena ?? words(String(at('task', 'arena', 'name') ?? '')).toLocaleLowerCase()
  return [
    words(String(at('algorithm', 'name') ?? 'training')),
    place,
    ...(typeof movers === 'number' && movers > 0 ? [`${movers} moving`] : []),
    ...(typeof robot === 'string' && robot !== USUAL_ROBOT ? [words(robot)] : []),
  ]
    .filter(Boolean)
    .join(', ')
}
