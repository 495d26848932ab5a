/** How each state of a run or an experiment is called and coloured, and what may be done in it. */
import type { ExperimentState, RunState } from '../api/types'

export const STATES: Record<ExperimentState, { label: string; color: string }> = {
  queued: { label: 'Queued', color: 'var(--mantine-color-gray-6)' },
  running: { label: 'Running', color: 'var(--mantine-primary-color-filled)' },
  stopping: { label: 'Stopping', color: 'var(--mantine-color-yellow-7)' },
  stopped: { label: 'Stopped', color: 'var(--mantine-color-gray-5)' },
  completed: { label: 'Completed', color: 'var(--mantine-color-green-7)' },
  failed: { label: 'Failed', color: 'var(--mantine-color-red-7)' },
  mixed: { label: 'Mixed', color: 'var(--mantine-color-yellow-7)' },
}

export const canStop = (states: readonly RunState[]): boolean =>
  states.some((state) => state === 'queued' || state === 'running')

export const canResume = (states: readonly RunState[]): boolean =>
  states.some((state) => state === 'stopped' || state === 'failed')

export const isActive = (state: ExperimentState): boolean =>
  state === 'queued' || state === 'running' || state === 'stopping'
