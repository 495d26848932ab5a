/** How each state of a run or an experiment is called and coloured, and what may be done in it. */
import type { ExperimentState, RunState } from '../api/types'

export const STATES: Record<ExperimentState, { label: string; color: string }> = {
  queued: { label: 'Queued', color: 'var(--mantine-color-gray-6)' },
  running: { label: 'Running', color: 'var(--mantine-primary-color-filled)' },
  stopping: { label: 'Stopping', color: 'var(--mantine-color-yellow-7)' },
  stopped: { label: 'Stopped', color: 'var(--mantine-color-gray-5)' },
  // Grey: that it has ended says nothing about how well the robot drives.
  completed: { label: 'Completed', color: 'var(--mapless-text-quiet)' },
  failed: { label: 'Failed', color: 'var(--mantine-color-red-7)' },
  mixed: { label: 'Ended differently', color: 'var(--mantine-color-yellow-7)' },
}

/** "Completed and failed": what became of several runs that ended differently. */
export function endsOf(states: readonly RunState[]): string {
  const labels = [...new Set(states)].map((state) => STATES[state].label.toLowerCase())
  const last = labels.pop()
  const text = labels.length > 0 ? `${labels.join(', ')} and ${last}` : (last ?? STATES.mixed.label)
  return text.charAt(0).toUpperCase() + text.slice(1)
}

export const canStop = (states: readonly RunState[]): boolean =>
  states.some((state) => state === 'queued' || state === 'running')

export const canResume = (states: readonly RunState[]): boolean =>
  states.some((state) => state === 'stopped' || state === 'failed')

export const isActive = (state: ExperimentState): boolean =>
  state === 'queued' || state === 'running' || state === 'stopping'
