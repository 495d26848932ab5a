/** A policy on a suite: its figures, where it drove, every episode. */
import { Anchor, Button, Group, Skeleton, Stack, Text } from '@mantine/core'
import { useRef } from 'react'
import { Link, useParams } from 'react-router'
import { $api } from '../api/client'
import type { AskedEvaluation, Outcome } from '../api/types'
import { EpisodesQuery } from '../components/Episodes'
import { suiteTitle } from '../components/evaluations/choices'
import { EvaluationExport } from '../components/evaluations/EvaluationExport'
import { isOpen, Progress, titleOf } from '../components/evaluations/EvaluationTable'
import { WaysMap } from '../components/evaluations/WaysMap'
import { SuccessEstimate } from '../components/MeasuredEstimate'
import { Replay } from '../components/replay/Replay'
import { Message, Page, Panel, QueryError } from '../components/ui'
import { arranged } from '../lib/episodes'
import { percent, significant, words } from '../lib/format'
import { useReplayInAddress, useTitle } from '../lib/hooks'
import { endedSo, useArrangement } from '../lib/useArrangement'
import classes from './EvaluationPage.module.css'

const FOR_GOOD = { staleTime: Number.POSITIVE_INFINITY }
const EVERY_MS = 1_000

export function EvaluationPage() {
  const { evaluationId = '' } = useParams()
  const path = { evaluation_id: evaluationId }
  const { data, error, refetch } = $api.useQuery(
    'get',
    '/api/evaluations/{evaluation_id}',
    { params: { path } },
    { refetchInterval: (query) => (query.state.data && isOpen(query.state.data) ? EVERY_MS : false) },
  )
  useTitle(data ? `${titleOf(data)} on ${data.suite ?? suiteTitle(data.choice)}` : 'Evaluation')
  return (
    <Page
      title={data ? titleOf(data) : error ? 'Evaluation' : <Skeleton height={24} width={240} />}
      above={
        <Anchor component={Link} to="/evaluations" size="xs">
          Evaluations
        </Anchor>
      }
      below={
        data && (
          <Text size="sm" c="dimmed" mt={4}>
            On {data.suite ?? suiteTitle(data.choice)}
          </Text>
        )
      }
      actions={data && <Links evaluation={data} />}
    >
      {data ? (
        <Loaded evaluation={data} />
      ) : (
        <Panel>
          {error ? <QueryError error={error} what="evaluation" retry={refetch} /> : <Skeleton height={460} />}
        </Panel>
      )}
    </Page>
  )
}

/** Where its policy comes from, and what else was measured on its suite. */
function Links({ evaluation: { id, policy, run_id, suite_hash, figures } }: { evaluation: AskedEvaluation }) {
  return (
    <Group gap="xs">
      {figures && <EvaluationExport id={id} />}
      {run_id && (
        <Button component={Link} to={`/runs/${run_id}`} variant="default">
          Its run
        </Button>
      )}
      {policy.source === 'shipped' && (
        <Button component={Link} to={`/policies/${policy.name}`} variant="default">
          The policy
        </Button>
      )}
      {suite_hash && (
        <Button component={Link} to={`/leaderboards/${suite_hash}`} variant="default">
          Leaderboard
        </Button>
      )}
    </Group>
  )
}

function Loaded({ evaluation }: { evaluation: AskedEvaluation }) {
  const [episode, setEpisode] = useReplayInAddress()
  const [{ order, reversed }] = useArrangement()
  const path = { evaluation_id: evaluation.id }
  const { figures } = evaluation
  const list = useRef<HTMLDivElement>(null)
  const show = () => list.current?.scrollIntoView({ block: 'start', behavior: 'smooth' })
  const episodes = $api.useQuery(
    'get',
    '/api/evaluations/{evaluation_id}/episodes',
    { params: { path } },
    { ...FOR_GOOD, enabled: figures !== null },
  )
  if (figures === null) {
    return (
      <Panel>
        {isOpen(evaluation) ? (
          <Stack gap="xs" role="status">
            <Text size="sm">It is being measured: figures, map and episodes appear here by themselves.</Text>
            <Progress evaluation={evaluation} />
          </Stack>
        ) : (
          <Message
            title={evaluation.state === 'cancelled' ? 'Called off' : 'It could not be measured'}
            role="alert"
          >
            {evaluation.error ?? 'No reason was given.'}
          </Message>
        )}
      </Panel>
    )
  }
  const facts: [name: string, value: string, hint?: string, outcome?: Outcome][] = [
    ['Collision', percent(figures.collision), 'Opens its episodes', 'collision'],
    ['Time-out', percent(figures.timeout), 'Opens its episodes', 'timeout'],
    ['SPL', figures.spl.toFixed(3), 'Success weighted by path length'],
    [
      'SPL of the worst tenth',
      figures.worst_tenth_spl.toFixed(3),
      'Over the tenth of the episodes that did worst',
    ],
    [
      'Time to target',
      figures.seconds === null ? '–' : `${significant(figures.seconds, 3)} s`,
      'Of arrivals',
    ],
    ['Path', figures.path_length === null ? '–' : `${significant(figures.path_length, 3)} m`, 'Of arrivals'],
    [
      'Clearance',
      `${figures.min_clearance.toFixed(2)} m`,
      "Mean of the episodes' smallest distance to anything",
    ],
    ['Jerk', `${significant(figures.jerk, 3)} m/s³`, 'Mean size along the heading'],
    ['Return', significant(figures.reward, 3), "By the policy's own reward, mean over episodes"],
  ]
  return (
    <Stack gap="md">
      <div className={classes.stage}>
        <Panel title="Where it drove">
          <WaysMap evaluationId={evaluation.id} onReplay={setEpisode} />
        </Panel>
        <Panel title="Figures">
          <div className={classes.success}>
            <Text size="xs" c="dimmed">
              Success, 95 % interval
            </Text>
            <ToEpisodes outcome="arrival" onFollow={show}>
              <SuccessEstimate estimate={figures.success} detail />
            </ToEpisodes>
          </div>
          <dl className={classes.facts}>
            {facts.map(([name, value, hint, outcome]) => (
              <div key={name} title={hint}>
                <dt>{name}</dt>
                <dd>
                  {outcome ? (
                    <ToEpisodes outcome={outcome} onFollow={show}>
                      {value}
                    </ToEpisodes>
                  ) : (
                    value
                  )}
                </dd>
              </div>
            ))}
          </dl>
          <Terms terms={figures.terms} />
        </Panel>
      </div>
      <div ref={list}>
        <Panel title="Episodes" flush>
          <EpisodesQuery query={episodes} onReplay={setEpisode} />
        </Panel>
      </div>
      {episode !== null && (
        <Replay
          of={`evaluation:${evaluation.id}`}
          episode={episode}
          order={arranged(episodes.data ?? { episodes: [] }, order, reversed).map(({ index }) => index)}
          onReplay={setEpisode}
          onClose={() => setEpisode(null)}
        />
      )}
    </Stack>
  )
}

interface ToEpisodesProps {
  outcome: Outcome
  onFollow: () => void
  children: React.ReactNode
}

/** A number that opens the episodes behind it. */
function ToEpisodes({ outcome, onFollow, children }: ToEpisodesProps) {
  return (
    <Anchor
      component={Link}
      to={endedSo(outcome)}
      replace
      preventScrollReset
      inherit
      title="Its episodes"
      onClick={onFollow}
    >
      {children}
    </Anchor>
  )
}

/** The return by the reward's terms. */
function Terms({ terms }: { terms: NonNullable<AskedEvaluation['figures']>['terms'] }) {
  if (terms === null)
    return (
      <Text size="xs" c="dimmed" mt="sm">
        The return by reward terms was not kept when this was measured.
      </Text>
    )
  return (
    <>
      <Text size="xs" c="dimmed" mt="md" mb={6}>
        Return by reward terms
      </Text>
      <dl className={classes.facts} aria-label="Return by reward terms">
        {terms.map(({ name, value }) => (
          <div key={name} title="Mean of the episodes' sums">
            <dt>{words(name)}</dt>
            <dd>{significant(value, 3)}</dd>
          </div>
        ))}
      </dl>
    </>
  )
}
