/** What lists and headings say about an experiment. */
import type { Experiment, TrainingConfig } from '../api/types'
import { words } from './format'

/** What nobody needs to be told: the robot that everybody starts with. */
const USUAL_ROBOT = 'burger'

/** "Simple, 4 moving · Jackal · PPO, MLP · Basic reward". */
export function summaryOf(training: TrainingConfig): string {
  const { arena, robot } = training.task
  return [
    arena.movers.count > 0 ? `${words(arena.name)}, ${arena.movers.count} moving` : words(arena.name),
    ...(robot.name === USUAL_ROBOT ? [] : [words(robot.name)]),
    algorithmOf(training),
    `${words(training.task.reward.name)} reward`,
  ].join(' · ')
}

/** "PPO, ResBlock". */
export function algorithmOf({ algorithm }: TrainingConfig): string {
  return `${words(algorithm.name)}, ${words(algorithm.network.name)}`
}

/** Steps done by all runs over the steps that they were given, 0 to 1. */
export function progressOf({ runs }: Experiment): number {
  const total = runs.reduce((sum, run) => sum + run.total_steps, 0)
  return total === 0 ? 0 : runs.reduce((sum, run) => sum + run.step, 0) / total
}

/** Seconds until its slowest running run is through, or null where that is not known. */
export function secondsLeftOf({ runs }: Experiment): number | null {
  const left = runs.map((run) => run.seconds_left).filter((seconds) => seconds !== null)
  return left.length === 0 ? null : Math.max(...left)
}
