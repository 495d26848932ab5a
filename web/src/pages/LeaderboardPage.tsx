/** Everything that was measured on a suite, the best first, and what can't be told from the best. */
import { Anchor, Badge, Select, Skeleton, Stack, Table, Text } from '@mantine/core'
import { Link, useNavigate, useParams } from 'react-router'
import { $api } from '../api/client'
import type { Leaderboard } from '../api/types'
import table from '../components/ExperimentTable.module.css'
import { SuccessEstimate } from '../components/MeasuredEstimate'
import { Page, Panel, QueryError } from '../components/ui'
import ui from '../components/ui.module.css'
import { plural, significant, words } from '../lib/format'
import { useTitle } from '../lib/hooks'

type Entry = Leaderboard['entries'][number]

/** Which suite is shown to who asks for none. */
const FIRST = 'complex-200'

export function LeaderboardPage() {
  const { suiteHash } = useParams()
  const navigate = useNavigate()
  const boards = $api.useQuery('get', '/api/leaderboards')
  const suites = boards.data?.suites ?? []
  const hash =
    suiteHash ?? (suites.find(({ suite }) => suite === FIRST) ?? suites[0])?.suite_hash ?? undefined
  const names = suites.map(({ suite }) => suite)
  return (
    <Page
      title="Leaderboards"
      above={
        <Anchor component={Link} to="/evaluations" size="xs">
          Evaluations
        </Anchor>
      }
      actions={
        <Select
          aria-label="Suite"
          searchable
          allowDeselect={false}
          w={280}
          placeholder="Suite"
          value={hash ?? null}
          onChange={(next) => next !== null && navigate(`/leaderboards/${next}`)}
          data={suites.map(({ suite, suite_hash }) => ({
            value: suite_hash,
            // Of one name there may be several, of other scenarios each.
            label: `${suite}${names.indexOf(suite) === names.lastIndexOf(suite) ? '' : ` ${suite_hash.slice(0, 6)}`}`,
          }))}
        />
      }
    >
      {boards.error && !boards.data ? (
        <Panel>
          <QueryError error={boards.error} what="list of leaderboards" retry={boards.refetch} />
        </Panel>
      ) : hash === undefined ? (
        <Skeleton height={400} />
      ) : (
        <Board key={hash} hash={hash} />
      )}
    </Page>
  )
}

function Board({ hash }: { hash: string }) {
  const { data, error, refetch } = $api.useQuery('get', '/api/leaderboards/{suite_hash}', {
    params: { path: { suite_hash: hash } },
  })
  useTitle(data ? `${data.suite} leaderboard` : 'Leaderboards')
  if (!data) {
    return (
      <Panel>
        {error ? <QueryError error={error} what="leaderboard" retry={refetch} /> : <Skeleton height={400} />}
      </Panel>
    )
  }
  const tied = data.entries.filter((entry) => entry.tied).length
  return (
    <Stack gap="md">
      {data.meaning && <Text size="sm">{data.meaning}</Text>}
      <Panel title={data.suite} flush>
        <Table.ScrollContainer type="native" minWidth={340}>
          <Table className={table.table} highlightOnHover aria-label={`Leaderboard of ${data.suite}`}>
            <Table.Thead>
              <Table.Tr>
                <Table.Th ta="right" w={64}>
                  Rank
                </Table.Th>
                <Table.Th>What</Table.Th>
                <Table.Th>Success, 95 % interval</Table.Th>
                <Table.Th visibleFrom="sm">From the best</Table.Th>
                <Table.Th ta="right" visibleFrom="sm" title="Success weighted by path length">
                  SPL
                </Table.Th>
                <Table.Th ta="right" visibleFrom="md">
                  Steps to target
                </Table.Th>
              </Table.Tr>
            </Table.Thead>
            <Table.Tbody>
              {data.entries.map((entry) => (
                <Row key={`${entry.kind} ${entry.id}`} entry={entry} />
              ))}
            </Table.Tbody>
          </Table>
        </Table.ScrollContainer>
      </Panel>
      <Text size="xs" c="dimmed">
        {plural(tied, 'entry').replace('entrys', 'entries')} can't be told from the best, itself included.{' '}
        {data.comparisons > 0 &&
          `${plural(data.comparisons, 'comparison')} with it stand here: of so many, some differ by chance. `}
        Entries of five seeds or more are told apart over seeds, all others over the episodes of these very
        policies, which says nothing of another seed. Hash {data.suite_hash.slice(0, 12)}.
      </Text>
    </Stack>
  )
}

const KINDS: Record<Entry['kind'], { label: string; to: (id: string) => string | null }> = {
  shipped: { label: 'Shipped', to: (id) => `/policies/${id}` },
  training: { label: 'Training', to: (id) => `/experiments/${id}` },
  evaluation: { label: 'Evaluation', to: (id) => `/evaluations/${id}` },
  baseline: { label: 'Untrained', to: () => null },
}

function Row({ entry }: { entry: Entry }) {
  const { label, to } = KINDS[entry.kind]
  const address = to(entry.id)
  const title = entry.kind === 'baseline' ? words(entry.title) : entry.title
  return (
    <Table.Tr data-testid="entry" data-tied={entry.tied || undefined}>
      <Table.Td ta="right" fw={550} className={ui.number}>
        {entry.rank}
      </Table.Td>
      <Table.Td>
        {address ? (
          <Anchor component={Link} to={address} size="sm" fw={550}>
            {title}
          </Anchor>
        ) : (
          title
        )}
        <Text size="xs" c="dimmed">
          {label}
        </Text>
      </Table.Td>
      <Table.Td>
        <SuccessEstimate estimate={entry.success} />
      </Table.Td>
      <Table.Td visibleFrom="sm">
        {entry.told_by === 'best' ? (
          <Badge size="sm" variant="light">
            Best
          </Badge>
        ) : (
          <Text size="sm" c={entry.tied ? 'inherit' : 'dimmed'} title={`Told by ${entry.told_by}`}>
            {entry.tied ? 'Tied' : 'Below'}
          </Text>
        )}
      </Table.Td>
      <Table.Td ta="right" className={ui.number} visibleFrom="sm">
        {entry.spl === null ? '–' : entry.spl.toFixed(2)}
      </Table.Td>
      <Table.Td ta="right" className={ui.number} visibleFrom="md">
        {entry.steps === null ? '–' : significant(entry.steps, 3)}
      </Table.Td>
    </Table.Tr>
  )
}
