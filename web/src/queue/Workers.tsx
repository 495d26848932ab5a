/** The workers: what each trains and how quickly, on what machine, how busy it was, and what was last heard of it. */
import { ActionIcon, Anchor, Group, Menu, Table, Text } from '@mantine/core'
import type { CSSProperties } from 'react'
import { Link } from 'react-router'
import { useAccount } from '../api/account'
import { $api } from '../api/client'
import type { Worker } from '../api/types'
import { ExperimentSwatch } from '../charts/Swatch'
import { Hint } from '../components/Hint'
import { IconDots } from '../components/icons'
import { Rows } from '../components/people/Rows'
import { useChange } from '../components/people/useChange'
import { Panel, ProgressBar } from '../components/ui'
import ui from '../components/ui.module.css'
import { age, compact, duration, percent } from '../lib/format'
import { useNow } from '../lib/hooks'
import classes from './queue.module.css'

const REFRESH_MS = 5_000

export function Workers() {
  const workers = $api.useQuery('get', '/api/workers', undefined, { refetchInterval: REFRESH_MS })
  const administrates = useAccount().data?.administrates ?? false
  return (
    <Panel title="Workers" flush data-testid="workers">
      <Rows
        what="Workers"
        head={['Worker', 'Trains', 'Speed', 'Machine', 'Last 7 days', '']}
        minWidth={860}
        query={workers}
        empty="No worker was ever heard of. Trainings wait until one is started: mapless worker"
      >
        {workers.data?.items.map((worker) => (
          <WorkerRow key={worker.name} worker={worker} administrates={administrates} />
        ))}
      </Rows>
    </Panel>
  )
}

function WorkerRow({ worker, administrates }: { worker: Worker; administrates: boolean }) {
  const { name, run, machine } = worker
  return (
    <Table.Tr data-testid="worker" className={worker.there ? undefined : classes.gone}>
      <Table.Td>
        <span className={classes.worker}>
          {name}
          <State worker={worker} />
        </span>
      </Table.Td>
      <Table.Td>
        {run ? (
          <span className={classes.trained}>
            <Group gap={8} wrap="nowrap">
              <ExperimentSwatch id={run.experiment_id} />
              <Anchor component={Link} to={`/runs/${run.id}`} size="sm">
                {run.experiment_name}, seed {run.seed}
              </Anchor>
            </Group>
            <ProgressBar value={run.progress} state="running" label={`Progress of ${run.experiment_name}`} />
            <span className={classes.words}>
              {percent(run.progress)}
              {run.seconds_left !== null && `, ${duration(run.seconds_left)} left`}
            </span>
          </span>
        ) : (
          <Text size="sm" c="dimmed">
            {worker.busy ? 'a run that you do not see' : worker.there ? 'nothing' : ''}
          </Text>
        )}
      </Table.Td>
      <Table.Td className={ui.number}>
        {run?.steps_per_second ? `${compact(run.steps_per_second)} steps/s` : '–'}
      </Table.Td>
      <Table.Td>
        {machine ? (
          <span className={classes.facts}>
            <span>
              {machine.host}, {worker.queue.toUpperCase()}
            </span>
            <span>
              load {machine.load.toFixed(1)} of {machine.cores}
            </span>
            {memory(machine.memory_used_bytes, machine.memory_bytes) && (
              <span>{memory(machine.memory_used_bytes, machine.memory_bytes)}</span>
            )}
            {machine.gpu && (
              <span>
                {machine.gpu.name}, {percent(machine.gpu.busy)},{' '}
                {memory(machine.gpu.used_bytes, machine.gpu.memory_bytes)}
              </span>
            )}
          </span>
        ) : (
          worker.queue.toUpperCase()
        )}
      </Table.Td>
      <Table.Td>
        <Strip activity={worker.activity} />
      </Table.Td>
      <Table.Td>{administrates && <Actions worker={worker} />}</Table.Td>
    </Table.Tr>
  )
}

function State({ worker }: { worker: Worker }) {
  const now = useNow()
  const { there, trouble, draining, last_words } = worker
  if (there && trouble) return <span className={classes.words}>takes up nothing: {trouble}</span>
  if (there) return draining ? <span className={classes.words}>ends after its run</span> : null
  return (
    <span className={classes.words}>
      gone: last heard of {age(worker.last_seen, now)}
      {(trouble ?? last_words) && `. Last words: ${trouble ?? last_words}`}
    </span>
  )
}

/** 28 times six hours, the oldest first; the darker, the busier. */
function Strip({ activity }: { activity: readonly number[] }) {
  const mean = activity.reduce((sum, share) => sum + share, 0) / activity.length
  const label = `Had a run ${percent(mean)} of the last 7 days`
  return (
    <Hint label={`${label}; a bar is six hours`}>
      <span className={classes.strip} role="img" aria-label={label}>
        {activity.map((share, index) => (
          // biome-ignore lint/suspicious/noArrayIndexKey: hours have no other identity.
          <span key={index} style={{ '--share': share } as CSSProperties} />
        ))}
      </span>
    </Hint>
  )
}

function Actions({ worker }: { worker: Worker }) {
  const change = useChange()
  const drain = $api.useMutation('post', '/api/workers/drain', change('drain it'))
  const remove = $api.useMutation('post', '/api/workers/remove', change('remove it'))
  const body = { worker: worker.name }
  return (
    <Menu position="bottom-end">
      <Menu.Target>
        <ActionIcon variant="subtle" color="gray" aria-label={`Actions for ${worker.name}`}>
          <IconDots size={18} />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown>
        {worker.there ? (
          <Menu.Item disabled={worker.draining} onClick={() => drain.mutate({ body })}>
            Drain: finish its runs, take up no more, end
          </Menu.Item>
        ) : (
          <Menu.Item onClick={() => remove.mutate({ body })}>Remove from this list</Menu.Item>
        )}
      </Menu.Dropdown>
    </Menu>
  )
}

function memory(used: number | null | undefined, total: number | null | undefined): string | null {
  if (total == null) return null
  const gigabytes = (bytes: number) => (bytes / 2 ** 30).toFixed(bytes < 10 * 2 ** 30 ? 1 : 0)
  return used == null ? `${gigabytes(total)} GiB` : `${gigabytes(used)} of ${gigabytes(total)} GiB`
}
