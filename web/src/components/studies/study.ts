/** What pages know of studies: their parts' types, and how their states are called. */
import type { ExperimentState, Study } from '../../api/types'

export type { ListedStudy, Study } from '../../api/types'
export type Trial = Study['results'][number]
export type SearchedSetting = Study['spec']['settings'][number]

/** In the words and colours of runs. */
export const STUDY_STATES: Record<Study['state'], { as: ExperimentState; label: string }> = {
  running: { as: 'running', label: 'Searching' },
  judging: { as: 'running', label: 'Judging the best' },
  done: { as: 'completed', label: 'Done' },
  stopped: { as: 'stopped', label: 'Stopped' },
}

export const TRIAL_STATES: Record<Trial['state'], { as: ExperimentState; label: string }> = {
  running: { as: 'running', label: 'Running' },
  complete: { as: 'completed', label: 'Complete' },
  pruned: { as: 'stopping', label: 'Stopped early' },
  failed: { as: 'failed', label: 'Failed' },
  stopped: { as: 'stopped', label: 'Stopped' },
}

export const goesOn = ({ state }: { state: Study['state'] }): boolean =>
  state === 'running' || state === 'judging'
