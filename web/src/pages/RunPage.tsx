/** One seed's training: how far it is, the robots live, its curves, its policies, what happened. */
import { Button, Group, Skeleton, Stack, Text } from '@mantine/core'
import { keepPreviousData, usePrefetchQuery } from '@tanstack/react-query'
import { useRef, useState } from 'react'
import { Link, useNavigate, useParams } from 'react-router'
import { useActions } from '../api/actions'
import { $api } from '../api/client'
import { isRefusal } from '../api/errors'
import type { Checkpoint, CheckpointPage, RunDetail } from '../api/types'
import { LinkedCharts } from '../charts/LinkedCharts'
import { sharedX, useKeptZoom } from '../charts/view'
import { Below } from '../components/Below'
import { CheckpointEpisodes } from '../components/CheckpointEpisodes'
import { CheckpointTable } from '../components/CheckpointTable'
import { Diagnoses } from '../components/Diagnoses'
import { ExperimentMenu } from '../components/ExperimentMenu'
import { WaitsForExtensions } from '../components/Extensions'
import { IconCopy, IconDownload, IconPlayerPlay, IconPlayerStop } from '../components/icons'
import { LearningSlider } from '../components/LearningSlider'
import { RunLineage } from '../components/Lineage'
import { RunLiveView } from '../components/LiveView'
import { Pager } from '../components/Pager'
import { AllCurves, MainCurves, runCurves, useRunCurves } from '../components/RunCurves'
import { RunLog } from '../components/RunLog'
import { LapseDialog } from '../components/replay/LapseDialog'
import { canResume, canStop, isActive } from '../components/states'
import { thinnedInWords } from '../components/storage/rules'
import { UnreadableSettings } from '../components/UnreadableSettings'
import { Notice, Page, Panel, ProgressBar, QueryError, StateLabel, Within } from '../components/ui'
import { useArenaTitle } from '../components/useArenaTitle'
import { at } from '../lib/base'
import { earlyHead } from '../lib/early'
import { inShort, summaryOf } from '../lib/experiments'
import { count, duration, percent } from '../lib/format'
import { useNumberInAddress, useReplayInAddress, useTitle } from '../lib/hooks'
import classes from './RunPage.module.css'

const CHECKPOINTS_A_PAGE = 25

const checkpointsOf = (runId: string, page: number) => ({
  params: {
    path: { run_id: runId },
    query: { limit: CHECKPOINTS_A_PAGE, offset: (page - 1) * CHECKPOINTS_A_PAGE },
  },
})

export function RunPage() {
  const { runId = '' } = useParams()
  // Beside the run itself: what is drawn first is not asked for only when that has come.
  usePrefetchQuery(runCurves(runId))
  usePrefetchQuery($api.queryOptions('get', '/api/runs/{run_id}/checkpoints', checkpointsOf(runId, 1)))
  const { data, error, refetch } = $api.useQuery('get', '/api/runs/{run_id}', {
    params: { path: { run_id: runId } },
  })
  useTitle(data ? `${data.experiment_name}, seed ${data.seed}` : 'Run')
  if (error && (!data || isRefusal(error))) {
    return (
      <Page title="Run">
        <Panel>
          <QueryError error={error} what="run" retry={refetch} />
        </Panel>
      </Page>
    )
  }
  if (!data) {
    return (
      <Page
        title={earlyHead().title ?? <Skeleton height={24} width={280} />}
        above={<Within page="RunPage" />}
      >
        <Panel>
          <Skeleton height={460} />
        </Panel>
      </Page>
    )
  }
  return <LoadedRun run={data} />
}

function LoadedRun({ run }: { run: RunDetail }) {
  const init = { params: { path: { run_id: run.id } } }
  const curves = useRunCurves(run)
  const keptZoom = useKeptZoom(curves.view, curves.onView)
  const arena = useArenaTitle(run.training.task.arena)
  const [page, setPage] = useState(1)
  const checkpoints = $api.useQuery('get', '/api/runs/{run_id}/checkpoints', checkpointsOf(run.id, page), {
    placeholderData: keepPreviousData,
  })
  const [step, setStep] = useNumberInAddress('step')
  const [watched, setWatched] = useNumberInAddress('watch')
  const [lapse, setLapse] = useNumberInAddress('lapse')
  const steps = $api.useQuery('get', '/api/runs/{run_id}/checkpoints/steps', init, {
    placeholderData: keepPreviousData,
  })
  const way = steps.data?.items ?? []
  // Of very many, the slider has some only; a row of the table may be any.
  const shown = nearest([...way, ...(checkpoints.data?.items ?? [])], watched)
  const [episode] = useReplayInAddress()
  const episodes = useRef<HTMLDivElement>(null)
  const view = useRef<HTMLDivElement>(null)
  const chosen = useChosen(run.id, checkpoints.data, step)
  const choose = (checkpoint: Checkpoint) => {
    setStep(checkpoint.step)
    episodes.current?.scrollIntoView({ block: 'start', behavior: 'smooth' })
  }
  const watch = (checkpoint: Checkpoint) => {
    setWatched(checkpoint.step)
    view.current?.scrollIntoView({ block: 'start', behavior: 'smooth' })
  }
  return (
    <Page
      title={`${run.experiment_name}, seed ${run.seed}`}
      above={
        <Within page="RunPage">
          {' / '}
          <Link to={`/experiments/${run.experiment_id}`}>{run.experiment_name}</Link>
        </Within>
      }
      below={
        <Text size="sm" c="dimmed" mt={4}>
          {summaryOf(inShort(run.training, arena))}
        </Text>
      }
      actions={<RunActions run={run} best={checkpoints.data?.best ?? null} known={!checkpoints.isPending} />}
    >
      <LinkedCharts of={sharedX(curves.view)} kept={keptZoom}>
        <Stack gap="md">
          <Vitals run={run} best={checkpoints.data?.best ?? null} known={!checkpoints.isPending} />
          {run.error && (
            <Notice bad title={run.state === 'failed' ? 'This run failed' : 'What happened'}>
              <Text size="sm" className={classes.error}>
                {run.error}
              </Text>
            </Notice>
          )}
          <WaitsForExtensions extensions={run.waits_for} />
          <UnreadableSettings names={run.unreadable} lacking={run.lacking} />
          <div className={classes.stage}>
            <Panel flush>
              <div ref={view} className={classes.episodes} />
              <RunLiveView
                key={run.id}
                runId={run.id}
                state={run.state}
                kept={checkpoints.data && checkpoints.data.total > 0}
                covered={lapse !== null || (episode !== null && chosen?.evaluation != null)}
                checkpoint={shown}
              />
              {way.length > 0 && (
                <LearningSlider
                  steps={way}
                  chosen={shown}
                  onChoose={setWatched}
                  own={!isActive(run.state) ? 'The best policy of the run' : 'What the run does now'}
                  onLapse={way.some(({ success }) => success !== null) ? () => setLapse(1) : undefined}
                />
              )}
            </Panel>
            <MainCurves curves={curves} />
            {thinnedInWords(run) && (
              <Text size="sm" c="dimmed" data-testid="thinned">
                {thinnedInWords(run)}
              </Text>
            )}
          </div>
          <Below height={1_600} now={episode !== null || step !== null}>
            <Diagnoses runId={run.id} state={run.state} />
            <AllCurves curves={curves} />
            <Panel title="Checkpoints" flush>
              {checkpoints.data ? (
                <>
                  <CheckpointTable
                    checkpoints={bestFirst(checkpoints.data)}
                    chosen={chosen}
                    onChoose={choose}
                    onWatch={watch}
                  />
                  <Pager
                    page={page}
                    size={CHECKPOINTS_A_PAGE}
                    total={checkpoints.data.total}
                    label="Pages of checkpoints"
                    onChange={setPage}
                  />
                </>
              ) : checkpoints.error ? (
                <QueryError error={checkpoints.error} what="checkpoints" retry={checkpoints.refetch} />
              ) : (
                <Skeleton height={120} m="md" w="auto" />
              )}
            </Panel>
            <RunLineage runId={run.id} />
            {chosen?.evaluation && (
              <div ref={episodes} className={classes.episodes}>
                <Panel title={`Episodes of step ${count(chosen.step)} on ${chosen.evaluation.suite}`} flush>
                  <CheckpointEpisodes key={chosen.id} checkpoint={chosen} />
                </Panel>
              </div>
            )}
            <RunLog runId={run.id} state={run.state} />
          </Below>
        </Stack>
      </LinkedCharts>
      {lapse !== null && <LapseDialog runId={run.id} onClose={() => setLapse(null)} />}
    </Page>
  )
}

/** The checkpoint of a step, or the one that is nearest to it; null where none is asked for, or there is none. */
function nearest<T extends { step: number }>(checkpoints: readonly T[], step: number | null): T | null {
  if (step === null) return null
  const away = (one: T) => Math.abs(one.step - step)
  return checkpoints.reduce<T | null>((best, one) => (best && away(best) <= away(one) ? best : one), null)
}

/** Those of a page of the list, below the best of all. */
function bestFirst({ best, items }: CheckpointPage): Checkpoint[] {
  return best ? [best, ...items.filter(({ id }) => id !== best.id)] : items
}

/** The checkpoint in the address, on whichever page of the list it stands, else the best one. */
function useChosen(
  runId: string,
  shown: CheckpointPage | undefined,
  step: number | null,
): Checkpoint | undefined {
  const here = shown?.items.find((checkpoint) => checkpoint.step === step)
  const elsewhere = $api.useQuery(
    'get',
    '/api/runs/{run_id}/checkpoints',
    { params: { path: { run_id: runId }, query: { step: step ?? 0, limit: 1 } } },
    { enabled: shown !== undefined && step !== null && here === undefined },
  )
  const wanted = step === null ? undefined : (here ?? elsewhere.data?.items[0])
  return wanted?.evaluation ? wanted : (shown?.best ?? undefined)
}

interface OfRun {
  run: RunDetail
  /** Its best checkpoint so far. */
  best: Checkpoint | null
  /** Whether it has been told; until then its place is kept, so that nothing jumps. */
  known: boolean
}

function RunActions({ run, best, known }: OfRun) {
  const navigate = useNavigate()
  const actions = useActions()
  const of = { params: { path: { run_id: run.id } } }
  const experiment = $api.useQuery('get', '/api/experiments/{experiment_id}', {
    params: { path: { experiment_id: run.experiment_id } },
  })
  return (
    <Group gap={6} className={classes.actions}>
      {canStop([run.state]) && (
        <Button
          variant="default"
          leftSection={<IconPlayerStop size={16} />}
          loading={actions.stopRun.isPending}
          onClick={() => actions.stopRun.mutate(of)}
        >
          Stop
        </Button>
      )}
      {canResume([run.state]) && (
        <Button
          variant="default"
          leftSection={<IconPlayerPlay size={16} />}
          loading={actions.resumeRun.isPending}
          onClick={() => actions.resumeRun.mutate(of)}
        >
          Resume
        </Button>
      )}
      {best && (
        <Button
          component="a"
          href={at(`/api/checkpoints/${best.id}/download`)}
          download
          leftSection={<IconDownload size={16} />}
        >
          Download the best
        </Button>
      )}
      {!known && (
        <Skeleton w="auto">
          <Button disabled aria-hidden leftSection={<IconDownload size={16} />}>
            Download the best
          </Button>
        </Skeleton>
      )}
      <Button
        variant="default"
        leftSection={<IconCopy size={16} />}
        component={Link}
        to={`/new?from=${run.experiment_id}`}
      >
        Duplicate
      </Button>
      {experiment.isPending && <Skeleton width={28} height={28} />}
      {experiment.data && (
        <ExperimentMenu
          experiment={{
            ...experiment.data,
            states: experiment.data.runs.map(({ state }) => state),
            runs: experiment.data.runs.length,
          }}
          runId={run.id}
          onDeleted={() => navigate('/')}
        />
      )}
    </Group>
  )
}

/** The figures that are glanced at: all in one line, with the progress under it. */
function Vitals({ run, best, known }: OfRun) {
  const progress = run.step / run.total_steps
  const figures: [label: string, value: string][] = [
    // The last rollout is whole, so that a completed run has some steps more than it was given.
    [
      'Steps',
      run.step < run.total_steps ? `${count(run.step)} of ${count(run.total_steps)}` : count(run.step),
    ],
    ...(run.seconds_left === null ? [] : [['Time left', duration(run.seconds_left)] as [string, string]]),
    ...(run.steps_per_second === null ? [] : [['Steps/s', count(run.steps_per_second)] as [string, string]]),
    ...(run.started_at !== null && run.finished_at !== null
      ? [['Took', duration(run.finished_at - run.started_at)] as [string, string]]
      : []),
    ['Success, training', run.success_rate === null ? '–' : percent(run.success_rate)],
    ['Success, evaluation', run.eval_success_rate === null ? '–' : percent(run.eval_success_rate)],
    ...(best
      ? [
          [
            'Best checkpoint',
            [best.evaluation && percent(best.evaluation.success.value), `step ${count(best.step)}`]
              .filter(Boolean)
              .join(' at '),
          ] as [string, string],
        ]
      : known
        ? []
        : [['Best checkpoint', '…'] as [string, string]]),
    ...(run.attempt > 1 ? [['Attempt', count(run.attempt)] as [string, string]] : []),
    ...(run.worker ? [['Worker', run.worker] as [string, string]] : []),
  ]
  return (
    <Panel data-testid="vitals">
      <dl className={classes.vitals}>
        <div>
          <dt>State</dt>
          <dd>
            <StateLabel state={run.state} />
          </dd>
        </div>
        {figures.map(([label, value]) => (
          <div key={label}>
            <dt>{label}</dt>
            <dd>{value}</dd>
          </div>
        ))}
      </dl>
      <ProgressBar value={progress} state={run.state} label="Progress" />
    </Panel>
  )
}
