/** What a person can do to experiments, campaigns and runs; each asks for the truth again afterwards and says what went wrong. */
import { notifications } from '@mantine/notifications'
import { useQueryClient } from '@tanstack/react-query'
import { $api } from './client'
import { messageOf } from './errors'

/** Mutations of experiments, campaigns and runs, ready to call. */
export function useActions() {
  const client = useQueryClient()
  const settle = (what: string) => ({
    onError: (error: unknown) =>
      notifications.show({ color: 'red', title: `Could not ${what}`, message: messageOf(error) }),
    onSettled: () => void client.invalidateQueries(),
  })
  return {
    stopExperiment: $api.useMutation(
      'post',
      '/api/experiments/{experiment_id}/stop',
      settle('stop the training'),
    ),
    resumeExperiment: $api.useMutation(
      'post',
      '/api/experiments/{experiment_id}/resume',
      settle('resume the training'),
    ),
    renameExperiment: $api.useMutation(
      'patch',
      '/api/experiments/{experiment_id}',
      settle('rename the training'),
    ),
    deleteExperiment: $api.useMutation(
      'delete',
      '/api/experiments/{experiment_id}',
      settle('delete the training'),
    ),
    launchReproduction: $api.useMutation('post', '/api/reproduction', settle('launch the reproduction')),
    stopReproduction: $api.useMutation(
      'post',
      '/api/reproduction/{campaign_id}/stop',
      settle('cancel the reproduction'),
    ),
    resumeReproduction: $api.useMutation(
      'post',
      '/api/reproduction/{campaign_id}/resume',
      settle('go on with the reproduction'),
    ),
    addSeedsToReproduction: $api.useMutation(
      'post',
      '/api/reproduction/{campaign_id}/seeds',
      settle('add seeds to the reproduction'),
    ),
    deleteReproduction: $api.useMutation(
      'delete',
      '/api/reproduction/{campaign_id}',
      settle('delete the reproduction'),
    ),
    stopRun: $api.useMutation('post', '/api/runs/{run_id}/stop', settle('stop the run')),
    resumeRun: $api.useMutation('post', '/api/runs/{run_id}/resume', settle('resume the run')),
  }
}
