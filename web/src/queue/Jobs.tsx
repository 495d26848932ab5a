/** For administrators: what workers do beside trainings. */
import { Button, Table } from '@mantine/core'
import { $api } from '../api/client'
import { Rows } from '../components/people/Rows'
import { useChange } from '../components/people/useChange'
import { Panel } from '../components/ui'
import ui from '../components/ui.module.css'
import { age, duration, percent, words } from '../lib/format'
import { useNow } from '../lib/hooks'

const SIZE = 20
const REFRESH_MS = 5_000

export function Jobs() {
  const now = useNow()
  const change = useChange()
  const jobs = $api.useQuery(
    'get',
    '/api/jobs',
    { params: { query: { limit: SIZE } } },
    { refetchInterval: REFRESH_MS },
  )
  const cancel = $api.useMutation('post', '/api/jobs/{job_id}/cancel', change('take it back'))
  return (
    <Panel title="Views, replays, films, exports, evaluations" flush data-testid="jobs">
      <Rows
        what="Jobs"
        head={['What', 'Of', 'State', 'By', 'Asked for', '']}
        query={jobs}
        empty="Nobody has asked for any lately."
      >
        {jobs.data?.items.map((job) => (
          <Table.Tr key={job.id} data-testid="job">
            <Table.Td>{words(job.kind)}</Table.Td>
            <Table.Td>{job.title}</Table.Td>
            <Table.Td>
              {job.state === 'running' ? percent(job.progress) : words(job.state)}
              {job.seconds_left !== null && `, ${duration(job.seconds_left)} left`}
              {job.error && job.state !== 'cancelled' && `: ${job.error}`}
            </Table.Td>
            <Table.Td>{job.worker}</Table.Td>
            <Table.Td className={ui.number}>{age(job.created_at, now)}</Table.Td>
            <Table.Td>
              {(job.state === 'queued' || job.state === 'running') && (
                <Button
                  size="compact-xs"
                  variant="default"
                  onClick={() => cancel.mutate({ params: { path: { job_id: job.id } } })}
                >
                  Take back
                </Button>
              )}
            </Table.Td>
          </Table.Tr>
        ))}
      </Rows>
    </Panel>
  )
}
