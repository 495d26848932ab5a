/** For administrators: who did what, when and from where. */
import { Button, Group, Select, Table, TextInput } from '@mantine/core'
import { useDebouncedValue } from '@mantine/hooks'
import { useState } from 'react'
import { $api } from '../api/client'
import { IconDownload } from '../components/icons'
import { Pager } from '../components/Pager'
import { Rows } from '../components/people/Rows'
import { Page, Panel } from '../components/ui'
import { HEADS } from '../heads'
import { at } from '../lib/base'
import { dateTime } from '../lib/format'
import { useTitle } from '../lib/hooks'

const SIZE = 50
const KINDS = [
  'experiment',
  'run',
  'campaign',
  'checkpoint',
  'arena',
  'alert_rule',
  'project',
  'member',
  'invitation',
  'person',
  'password',
  'session',
  'token',
  'worker_token',
  'worker',
]

export function AuditPage() {
  useTitle(HEADS.AuditPage.title)
  const [page, setPage] = useState(1)
  const [typed, setTyped] = useState('')
  const [kind, setKind] = useState<string | null>(null)
  const [actor] = useDebouncedValue(typed.trim(), 300)
  const wanted = { ...(actor ? { actor } : {}), ...(kind ? { action: kind } : {}) }
  const entries = $api.useQuery('get', '/api/audit', {
    params: { query: { ...wanted, limit: SIZE, offset: (page - 1) * SIZE } },
  })
  return (
    <Page
      {...HEADS.AuditPage}
      actions={
        <Button
          component="a"
          href={at(`/api/audit/csv?${new URLSearchParams(wanted)}`)}
          variant="default"
          leftSection={<IconDownload size={16} />}
        >
          CSV
        </Button>
      }
    >
      <Panel flush>
        <Group gap="sm" p="md">
          <TextInput
            placeholder="By whom (the whole name)"
            aria-label="By whom"
            value={typed}
            onChange={(event) => {
              setTyped(event.currentTarget.value)
              setPage(1)
            }}
          />
          <Select
            placeholder="Everything"
            aria-label="Kind"
            clearable
            data={KINDS.map((value) => ({ value, label: value.replace('_', ' ') }))}
            value={kind}
            onChange={(value) => {
              setKind(value)
              setPage(1)
            }}
          />
        </Group>
        <Rows
          what="Entries"
          head={['When', 'Who', 'What', 'To what', 'From']}
          query={entries}
          empty="Nothing was done, or nothing like this."
        >
          {entries.data?.items.map((entry) => (
            <Table.Tr key={entry.id} data-testid="entry">
              <Table.Td style={{ whiteSpace: 'nowrap' }}>{dateTime(entry.at)}</Table.Td>
              <Table.Td>{entry.actor}</Table.Td>
              <Table.Td>{entry.action.replaceAll(/[._]/g, ' ')}</Table.Td>
              <Table.Td>{[entry.name ?? entry.target, entry.details].filter(Boolean).join(', ')}</Table.Td>
              <Table.Td>{entry.address}</Table.Td>
            </Table.Tr>
          ))}
        </Rows>
        <Pager
          page={page}
          size={SIZE}
          total={entries.data?.total ?? 0}
          label="Pages of the log"
          onChange={setPage}
        />
      </Panel>
    </Page>
  )
}
