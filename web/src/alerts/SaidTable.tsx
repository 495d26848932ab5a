/** What rules have said, to whom, and what came of it. */
import { Anchor, Table, Text } from '@mantine/core'
import { useState } from 'react'
import { Link } from 'react-router'
import { $api } from '../api/client'
import type { Alert } from '../api/types'
import { Pager } from '../components/Pager'
import { Rows } from '../components/people/Rows'
import { dateTime } from '../lib/format'
import { hostOf, STATES } from './wording'

const SIZE = 20
/** While something is on its way, it is looked at again. */
const LOOK_MS = 2_000
const CALM_MS = 15_000

export function SaidTable() {
  const [page, setPage] = useState(1)
  const alerts = $api.useQuery(
    'get',
    '/api/alerts',
    { params: { query: { limit: SIZE, offset: (page - 1) * SIZE } } },
    {
      refetchInterval: ({ state }) =>
        state.data?.items.some(({ state: its }) => its === 'waiting' || its === 'sending')
          ? LOOK_MS
          : CALM_MS,
    },
  )
  return (
    <>
      <Rows
        what="Alerts"
        head={['When', 'What', 'To', 'Outcome']}
        query={alerts}
        empty="Nothing has been told yet."
      >
        {alerts.data?.items.map((alert) => (
          <Table.Tr key={alert.id} data-testid="alert">
            <Table.Td style={{ whiteSpace: 'nowrap' }}>{dateTime(alert.created_at)}</Table.Td>
            <Table.Td>
              <Title alert={alert} />
              <Text size="xs" c="dimmed" lineClamp={3}>
                {alert.text}
              </Text>
            </Table.Td>
            <Table.Td style={{ overflowWrap: 'anywhere' }}>{recipient(alert)}</Table.Td>
            <Table.Td>
              {STATES[alert.state]}
              {alert.outcome && (
                <Text size="xs" c="dimmed">
                  {alert.outcome}
                  {alert.next_at !== null && ` Again at ${dateTime(alert.next_at)}.`}
                </Text>
              )}
            </Table.Td>
          </Table.Tr>
        ))}
      </Rows>
      <Pager
        page={page}
        size={SIZE}
        total={alerts.data?.total ?? 0}
        label="Pages of alerts"
        onChange={setPage}
      />
    </>
  )
}

function Title({ alert: { title, run_id, experiment_id } }: { alert: Alert }) {
  const path = run_id ? `/runs/${run_id}` : experiment_id ? `/experiments/${experiment_id}` : undefined
  return path ? (
    <Anchor component={Link} to={path} size="sm" display="block">
      {title}
    </Anchor>
  ) : (
    <Text size="sm">{title}</Text>
  )
}

function recipient({ channel, target }: Alert): string {
  if (channel === 'browser') return 'Browser'
  return channel === 'webhook' ? hostOf(target ?? '') : (target ?? '')
}
