/** One search: how far it is, what its trials show, and what the best of them is worth. */
import { ActionIcon, Anchor, Button, Group, Skeleton, Stack, Text } from '@mantine/core'
import { useDisclosure } from '@mantine/hooks'
import { Link, useNavigate, useParams } from 'react-router'
import { $api } from '../api/client'
import { isRefusal } from '../api/errors'
import { DeleteDialog } from '../components/DeleteDialog'
import { Hint } from '../components/Hint'
import { IconPlayerPlay, IconPlayerStop, IconPlus, IconRocket, IconTrash } from '../components/icons'
import { SuccessEstimate } from '../components/MeasuredEstimate'
import { useChange } from '../components/people/useChange'
import { settingTitles } from '../components/studies/charts'
import { StudyCharts } from '../components/studies/StudyCharts'
import { SAMPLERS } from '../components/studies/StudySettings'
import { StudyStateLabel } from '../components/studies/StudyStateLabel'
import { goesOn, STUDY_STATES, type Study } from '../components/studies/study'
import { TrialTable } from '../components/studies/TrialTable'
import { Page, Panel, ProgressBar, QueryError } from '../components/ui'
import type { Schema } from '../form/schema'
import { dateTime, duration, percent, plural } from '../lib/format'
import { useTitle } from '../lib/hooks'

/** How often a study that goes on is asked after. */
const EVERY_MS = 3_000
/** Trials that one click adds. */
const MORE = 10

export function StudyPage() {
  const { studyId = '' } = useParams()
  const { data, error, refetch } = $api.useQuery(
    'get',
    '/api/studies/{study_id}',
    { params: { path: { study_id: studyId } } },
    { refetchInterval: ({ state }) => (state.data && goesOn(state.data) ? EVERY_MS : false) },
  )
  const form = $api.useQuery('get', '/api/training/form', undefined, { staleTime: Number.POSITIVE_INFINITY })
  useTitle(data?.name ?? 'Study')
  if (error && (!data || isRefusal(error))) {
    return (
      <Page title="Study">
        <Panel>
          <QueryError error={error} what="study" retry={refetch} />
        </Panel>
      </Page>
    )
  }
  if (!data) {
    return (
      <Page title={<Skeleton height={24} width={260} />}>
        <Skeleton height={300} aria-busy="true" aria-label="Loading the study" />
      </Page>
    )
  }
  const titles = settingTitles(
    data.spec.settings,
    form.data?.schema as Schema | undefined,
    data.spec.training,
  )
  const { as, label } = STUDY_STATES[data.state]
  return (
    <Page
      title={data.name}
      above={
        <Anchor component={Link} to="/studies" size="xs">
          Studies
        </Anchor>
      }
      below={
        <Group gap="md" mt={4}>
          <Text size="sm" data-testid="study-state">
            <StudyStateLabel as={as} label={label} />
          </Text>
          <Text size="sm" c="dimmed">
            {SAMPLERS.find((one) => one.value === data.sampler)?.label},{' '}
            {plural(data.spec.seeds.length, 'seed')} a trial
          </Text>
          <Text size="sm" c="dimmed">
            launched {dateTime(data.created_at)}
          </Text>
        </Group>
      }
      actions={<StudyActions study={data} />}
    >
      <Stack gap="md">
        <Panel>
          <Progress study={data} />
        </Panel>
        <StudyCharts study={data} titles={titles} />
        <Panel title={plural(data.results.length, 'trial')} flush>
          <TrialTable study={data} titles={titles} />
        </Panel>
      </Stack>
    </Page>
  )
}

function Progress({ study }: { study: Study }) {
  const { as } = STUDY_STATES[study.state]
  const through = study.complete + study.pruned + study.failed
  const left = study.seconds_left
  return (
    <Stack gap="xs">
      <Group justify="space-between" gap="xs">
        <Text size="sm">
          {through} of {plural(study.trials, 'trial')} through: {study.complete} complete, {study.pruned}{' '}
          stopped early, {study.failed} failed
        </Text>
        {study.state === 'running' && (
          <Text size="sm" c="dimmed">
            {left === null ? 'time left not known yet' : `about ${duration(left)} left`}
          </Text>
        )}
      </Group>
      <ProgressBar value={study.progress} state={as} label="Progress of the study" />
      {study.best !== null && study.best_success !== null && (
        <Text size="sm">
          Best by its tuning seeds: trial {study.best} with {percent(study.best_success)}.
        </Text>
      )}
      {study.judgement && (
        <Text size="sm" component="div" data-testid="judgement">
          Judged on {study.judgement.seeds.length} seeds that the search never saw:{' '}
          <Anchor
            component={Link}
            to={`/experiments/${study.judgement.experiment_id}`}
            inherit
            underline="always"
          >
            trial {study.judgement.trial}
          </Anchor>{' '}
          {study.judgement.success ? (
            <SuccessEstimate estimate={study.judgement.success} />
          ) : (
            'is being trained.'
          )}
        </Text>
      )}
      {study.rule && (
        <Text size="xs" c="dimmed">
          {study.rule}
        </Text>
      )}
    </Stack>
  )
}

function StudyActions({ study }: { study: Study }) {
  const navigate = useNavigate()
  const settle = useChange()
  const [asking, ask] = useDisclosure()
  const stop = $api.useMutation('post', '/api/studies/{study_id}/stop', settle('stop the study'))
  const resume = $api.useMutation('post', '/api/studies/{study_id}/resume', settle('resume the study'))
  const extend = $api.useMutation('post', '/api/studies/{study_id}/extend', settle('extend the study'))
  const remove = $api.useMutation('delete', '/api/studies/{study_id}', {
    ...settle('delete the study'),
    onSuccess: () => navigate('/studies'),
  })
  const of = { params: { path: { study_id: study.id } } }
  const best = study.results.find((trial) => trial.number === study.best)
  return (
    <Group gap="xs">
      {goesOn(study) && (
        <Button
          variant="default"
          leftSection={<IconPlayerStop size={16} />}
          loading={stop.isPending}
          onClick={() => stop.mutate(of)}
        >
          Stop
        </Button>
      )}
      {study.state === 'stopped' && (
        <Button
          variant="default"
          leftSection={<IconPlayerPlay size={16} />}
          loading={resume.isPending}
          onClick={() => resume.mutate(of)}
        >
          Resume
        </Button>
      )}
      {study.state !== 'judging' && (
        <Button
          variant="default"
          leftSection={<IconPlus size={16} />}
          loading={extend.isPending}
          onClick={() => extend.mutate({ ...of, body: { trials: MORE } })}
        >
          {MORE} more trials
        </Button>
      )}
      {best?.experiment_id && (
        <Button
          component={Link}
          to={`/new?from=${best.experiment_id}`}
          leftSection={<IconRocket size={16} />}
          variant={study.state === 'done' ? 'filled' : 'default'}
        >
          Train the best
        </Button>
      )}
      <Hint label="Delete this study">
        <ActionIcon variant="default" size={36} aria-label="Delete this study" onClick={ask.open}>
          <IconTrash size={16} />
        </ActionIcon>
      </Hint>
      <DeleteDialog
        opened={asking}
        what="this study"
        busy={remove.isPending}
        onClose={ask.close}
        onDelete={() => remove.mutate(of)}
      >
        What it has found is forgotten. Its trials go into the trash; the training that judged the best stays.
      </DeleteDialog>
    </Group>
  )
}
