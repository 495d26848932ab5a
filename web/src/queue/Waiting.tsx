/** The runs that wait, in the order of their turns: what for, until when, and how urgent each is. */
import { ActionIcon, Anchor, Group, NumberInput, Table, Text } from '@mantine/core'
import { useState } from 'react'
import { Link } from 'react-router'
import { useAccount } from '../api/account'
import { $api } from '../api/client'
import type { WaitingRun } from '../api/types'
import { ExperimentSwatch } from '../charts/Swatch'
import { Hint } from '../components/Hint'
import { IconArrowUp } from '../components/icons'
import { Pager } from '../components/Pager'
import { ParallelRuns } from '../components/ParallelRuns'
import { Rows } from '../components/people/Rows'
import { useChange } from '../components/people/useChange'
import { Panel } from '../components/ui'
import ui from '../components/ui.module.css'
import { age, count, duration, plural, words } from '../lib/format'
import { useNow } from '../lib/hooks'
import { useDrag } from './drag'
import { Handle } from './Handle'
import classes from './queue.module.css'

const SIZE = 50
const REFRESH_MS = 5_000

export function Waiting() {
  const [page, setPage] = useState(1)
  const queue = $api.useQuery(
    'get',
    '/api/queue',
    { params: { query: { limit: SIZE, offset: (page - 1) * SIZE } } },
    { refetchInterval: REFRESH_MS, placeholderData: (before) => before },
  )
  const mayOrder = useAccount().data?.may_launch ?? false
  const { total = 0, hidden = 0, items = [] } = queue.data ?? {}
  const place = $api.useMutation('put', '/api/runs/{run_id}/place', useChange()('move it'))
  const drag = useDrag(
    items.map(({ id }) => id),
    (run_id, body) => place.mutate({ params: { path: { run_id } }, body }),
  )
  return (
    <Panel
      title="Waiting"
      actions={
        hidden > 0 && (
          <Text size="xs" c="dimmed">
            {`and ${plural(hidden, 'run')} of projects that you do not see`}
          </Text>
        )
      }
      flush
      data-testid="waiting"
    >
      <Rows
        what="Runs that wait"
        head={['Turn', 'Training', 'Waits for', 'Begins', 'Waits since', 'Priority', '']}
        minWidth={860}
        query={queue}
        empty="Nothing waits: what is launched now begins as soon as a worker is free."
      >
        {queue.data?.items.map((run) => (
          <WaitingRow key={run.id} run={run} mayOrder={mayOrder} drag={drag} />
        ))}
      </Rows>
      <Pager page={page} size={SIZE} total={total} label="Pages of the queue" onChange={setPage} />
    </Panel>
  )
}

interface WaitingRowProps {
  run: WaitingRun
  mayOrder: boolean
  drag: ReturnType<typeof useDrag>
}

function WaitingRow({ run, mayOrder, drag }: WaitingRowProps) {
  const now = useNow()
  const change = useChange()
  const path = { params: { path: { run_id: run.id } } }
  const front = $api.useMutation('post', '/api/runs/{run_id}/front', change('move it to the front'))
  const name = `${run.experiment_name}, seed ${run.seed}`
  return (
    <Table.Tr data-testid="waiting-run" className={classes.waiting} {...drag.rowOf(run.id)}>
      <Table.Td className={ui.number}>
        <span className={classes.turn}>
          {mayOrder && <Handle name={name} drag={drag.handleOf(run.id)} />}
          {count(run.position)}
        </span>
      </Table.Td>
      <Table.Td>
        <Group gap={8} wrap="nowrap">
          <ExperimentSwatch id={run.experiment_id} />
          <Anchor component={Link} to={`/runs/${run.id}`} size="sm">
            {name}
          </Anchor>
        </Group>
        <div className={classes.waits}>
          {words(run.algorithm)}, {run.step > 0 ? `${count(run.step)} of ` : ''}
          {count(run.total_steps)} steps
        </div>
      </Table.Td>
      <Table.Td>
        <span className={classes.waits} data-stuck={run.waits_for !== 'turn' || undefined}>
          {waitsFor(run)}
        </span>
        {mayOrder && (run.waits_for === 'experiment limit' || run.parallel_runs !== null) && (
          <div>
            <ParallelRuns
              experiment={{
                id: run.experiment_id,
                name: run.experiment_name,
                parallel_runs: run.parallel_runs,
              }}
            />
          </div>
        )}
      </Table.Td>
      <Table.Td className={ui.number}>{begins(run)}</Table.Td>
      <Table.Td className={ui.number}>{age(run.queued_at, now)}</Table.Td>
      <Table.Td>
        {mayOrder ? <PriorityInput key={run.priority} run={run} name={name} /> : count(run.priority)}
      </Table.Td>
      <Table.Td>
        {mayOrder && (
          <Hint label="To the front">
            <ActionIcon
              variant="subtle"
              color="gray"
              aria-label={`${name}: to the front`}
              disabled={run.position === 1}
              loading={front.isPending}
              onClick={() => front.mutate(path)}
            >
              <IconArrowUp size={18} />
            </ActionIcon>
          </Hint>
        )}
      </Table.Td>
    </Table.Tr>
  )
}

/** Sent where it is left, or by Enter; Escape takes back what was typed. */
function PriorityInput({ run, name }: { run: WaitingRun; name: string }) {
  const change = useChange()
  const [typed, setTyped] = useState<number | string>(run.priority)
  const give = $api.useMutation('put', '/api/runs/{run_id}/priority', {
    ...change('change the priority'),
    onError: (error: unknown) => {
      setTyped(run.priority)
      change('change the priority').onError(error)
    },
  })
  const send = () => {
    if (typeof typed !== 'number') setTyped(run.priority)
    else if (typed !== run.priority) {
      give.mutate({ params: { path: { run_id: run.id } }, body: { priority: typed } })
    }
  }
  return (
    <NumberInput
      size="xs"
      className={classes.priority}
      aria-label={`${name}: priority`}
      allowDecimal={false}
      min={-1_000_000}
      max={1_000_000}
      value={typed}
      disabled={give.isPending}
      onChange={setTyped}
      onBlur={send}
      onKeyDown={(event) => {
        if (event.key === 'Enter') event.currentTarget.blur()
        if (event.key === 'Escape') setTyped(run.priority)
      }}
    />
  )
}

function waitsFor({ waits_for, extensions }: WaitingRun): string {
  switch (waits_for) {
    case 'turn':
      return 'its turn'
    case 'worker':
      return 'a worker: none is there'
    case 'gpu':
      return 'a worker with a GPU: none is there'
    case 'extension':
      return `a worker with ${extensions.join(', ')}: none is there`
    case 'person limit':
      return 'a limit: whoever launched it has as many runs under way as may be'
    case 'experiment limit':
      return 'a limit: as many runs of its experiment are under way as may be'
    case 'other worker':
      return 'another worker: those that are there lost it too often'
  }
}

/** In words; "unknown" where nothing is known of the rates, or nobody is there to train it. */
function begins({ starts_in }: WaitingRun): string {
  if (starts_in === null) return 'unknown'
  return starts_in < 1 ? 'now' : `in ${duration(starts_in)}`
}
