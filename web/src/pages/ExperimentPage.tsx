/** One configuration with all its seeds. */
import { Anchor, Box, Button, Group, Skeleton, Stack, Text } from '@mantine/core'
import { Link, useNavigate, useParams } from 'react-router'
import { useActions } from '../api/actions'
import { $api } from '../api/client'
import { isRefusal } from '../api/errors'
import type { Experiment } from '../api/types'
import { Below } from '../components/Below'
import { ExperimentMenu } from '../components/ExperimentMenu'
import { IconArrowsDiff, IconCopy, IconPlayerPlay, IconPlayerStop } from '../components/icons'
import { SuccessEstimate } from '../components/MeasuredEstimate'
import { ParallelRuns } from '../components/ParallelRuns'
import { RunTable } from '../components/RunTable'
import { canResume, canStop } from '../components/states'
import { UnreadableSettings } from '../components/UnreadableSettings'
import { Page, Panel, QueryError, StateLabel, Within } from '../components/ui'
import { useArenaTitle } from '../components/useArenaTitle'
import { earlyHead } from '../lib/early'
import { inShort, summaryOf } from '../lib/experiments'
import { dateTime, plural } from '../lib/format'
import { useTitle } from '../lib/hooks'
import { lazily } from '../lib/lazily'
import { painted } from '../lib/painted'
import { SeedsButton } from '../workbench/SeedsButton'

const ExperimentDetails = lazily(async () => {
  await painted()
  return (await import('../components/ExperimentDetails')).ExperimentDetails
})
const DETAILS_HEIGHT = 1_400

export function ExperimentPage() {
  const { experimentId = '' } = useParams()
  const { data, error, refetch } = $api.useQuery('get', '/api/experiments/{experiment_id}', {
    params: { path: { experiment_id: experimentId } },
  })
  useTitle(data?.name ?? 'Training')
  if (error && (!data || isRefusal(error))) {
    return (
      <Page title="Training">
        <Panel>
          <QueryError error={error} what="training" retry={refetch} />
        </Panel>
      </Page>
    )
  }
  return data ? <LoadedExperiment experiment={data} /> : <LoadingExperiment />
}

function LoadingExperiment() {
  return (
    <Page
      title={earlyHead().title ?? <Skeleton height={24} width={260} />}
      above={<Within page="ExperimentPage" />}
    >
      <Stack>
        <Panel>
          <Skeleton height={120} />
        </Panel>
        <Panel>
          <Skeleton height={260} />
        </Panel>
      </Stack>
    </Page>
  )
}

function LoadedExperiment({ experiment }: { experiment: Experiment }) {
  const navigate = useNavigate()
  const actions = useActions()
  const states = experiment.runs.map((run) => run.state)
  const arena = useArenaTitle(experiment.training.task.arena)
  const of = { params: { path: { experiment_id: experiment.id } } }
  return (
    <Page
      title={experiment.name}
      above={<Within page="ExperimentPage" />}
      below={
        <Group gap="md" mt={4}>
          <Text size="sm">
            <StateLabel state={experiment.state} states={states} />
          </Text>
          <Text size="sm" c="dimmed">
            {summaryOf(inShort(experiment.training, arena))}
          </Text>
          <Text size="sm" c="dimmed">
            launched {dateTime(experiment.created_at)}
          </Text>
          {experiment.study_id && (
            <Anchor component={Link} to={`/studies/${experiment.study_id}`} size="sm">
              a trial of a study
            </Anchor>
          )}
          {experiment.campaign && (
            <Anchor component={Link} to={`/reproduction?campaign=${experiment.campaign}`} size="sm">
              a row of the paper's tables
            </Anchor>
          )}
        </Group>
      }
      actions={
        <Group gap="xs">
          {canStop(states) && (
            <Button
              variant="default"
              leftSection={<IconPlayerStop size={16} />}
              loading={actions.stopExperiment.isPending}
              onClick={() => actions.stopExperiment.mutate(of)}
            >
              Stop
            </Button>
          )}
          {canResume(states) && (
            <Button
              variant="default"
              leftSection={<IconPlayerPlay size={16} />}
              loading={actions.resumeExperiment.isPending}
              onClick={() => actions.resumeExperiment.mutate(of)}
            >
              Resume
            </Button>
          )}
          <SeedsButton experiment={experiment} />
          <Button
            variant="default"
            leftSection={<IconCopy size={16} />}
            component={Link}
            to={`/new?from=${experiment.id}`}
          >
            Duplicate
          </Button>
          <Button
            variant="default"
            leftSection={<IconArrowsDiff size={16} />}
            component={Link}
            to={`/compare?experiment=${experiment.id}`}
          >
            Compare
          </Button>
          <ExperimentMenu
            experiment={{ ...experiment, states, runs: experiment.runs.length }}
            onDeleted={() => navigate('/')}
          />
        </Group>
      }
    >
      <Stack gap="md">
        <UnreadableSettings names={experiment.unreadable} lacking={experiment.lacking} />
        <Panel
          flush
          title={plural(experiment.runs.length, 'run')}
          actions={
            <Group gap="md">
              {(canStop(states) || experiment.parallel_runs !== null) && (
                <ParallelRuns experiment={experiment} />
              )}
              {experiment.success && (
                <Text size="sm" component="div">
                  Success <SuccessEstimate estimate={experiment.success} detail />
                </Text>
              )}
            </Group>
          }
        >
          <RunTable runs={experiment.runs} />
        </Panel>
        <Below height={DETAILS_HEIGHT}>
          <ExperimentDetails experiment={experiment} meanwhile={<Box mih={DETAILS_HEIGHT} />} />
        </Below>
      </Stack>
    </Page>
  )
}
