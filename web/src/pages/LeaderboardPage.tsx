/** Everything that was measured on a suite, the best first, and what can't be told from the best. */
import { Anchor, Badge, Select, Skeleton, Stack, Table, Text } from '@mantine/core'
import { Link, useNavigate, useParams } from 'react-router'
import { $api } from '../api/client'
import type { Leaderboard } from '../api/types'
import table from '../components/ExperimentTable.module.css'
import { SuccessEstimate } from '../components/MeasuredEstimate'
import { Page, Panel, QueryError, Within } from '../components/ui'
import ui from '../components/ui.module.css'
import { HEADS } from '../heads'
import { plural, significant, words } from '../lib/format'
import { useTitle } from '../lib/hooks'
import { endedSo } from '../lib/useArrangement'

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
      title={HEADS.LeaderboardPage.title}
      about={HEADS.LeaderboardPage.about}
      above={<Within page="LeaderboardPage" />}
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
          `${plural(data.comparisons, 'test')} against it stand here, adjusted for how many they are (Holm). `}
        Entries of five seeds or more are told over their seeds; single policies by the episodes of these very
        policies, which says nothing of another seed; of two to four seeds nothing is told. Hash{' '}
        {data.suite_hash.slice(0, 12)}.
      </Text>
    </Stack>
  )
}

const KINDS: Record<Entry['kind'], string> = {
  shipped: 'Shipped',
  training: 'Training',
  evaluation: 'Evaluation',
  baseline: 'Untrained',
  uploaded: 'Uploaded',
}

/** Where more is to be seen of an entry: of several seeds their training, else the evaluation, or what ships. */
function addressOf({ kind, id, experiment_id, evaluations }: Entry): string | null {
  if (experiment_id && evaluations?.length !== 1) return `/experiments/${experiment_id}`
  if (evaluations?.[0]) return `/evaluations/${evaluations[0]}`
  return kind === 'shipped' ? `/policies/${id}` : null
}

/** "Tied", or "Not told" where there is no test that could tell. */
function wordOf({ tied, told_by }: Entry): string {
  if (told_by === 'nothing') return 'Not told'
  return tied ? 'Tied' : 'Below'
}

/** Why it is called so. */
function reasonOf({ told_by, p }: Entry): string {
  if (told_by === 'nothing') return 'Two to four seeds tell nothing'
  const adjusted = p == null ? '' : `, p ${p < 0.001 ? '< 0.001' : `= ${p.toFixed(3)}`} after all tests here`
  return `Told by ${told_by}${adjusted}`
}

function Row({ entry }: { entry: Entry }) {
  const address = addressOf(entry)
  const only = entry.evaluations?.length === 1 ? entry.evaluations[0] : undefined
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
          {KINDS[entry.kind]}
        </Text>
      </Table.Td>
      <Table.Td>
        {only !== undefined ? (
          <Anchor
            component={Link}
            to={`/evaluations/${only}${endedSo('arrival')}`}
            c="inherit"
            size="sm"
            title="Its episodes"
          >
            <SuccessEstimate estimate={entry.success} />
          </Anchor>
        ) : (
          <SuccessEstimate estimate={entry.success} />
        )}
      </Table.Td>
      <Table.Td visibleFrom="sm">
        {entry.told_by === 'best' ? (
          <Badge size="sm" variant="light">
            Best
          </Badge>
        ) : (
          <Text size="sm" c={entry.tied ? 'inherit' : 'dimmed'} title={reasonOf(entry)}>
            {wordOf(entry)}
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
