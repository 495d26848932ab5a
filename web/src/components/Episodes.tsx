/** The episodes of an evaluation, failures first or by any of their numbers, each with its replay. */
import { Button, Group, Skeleton, Table, Text, UnstyledButton, VisuallyHidden } from '@mantine/core'
import { useState } from 'react'
import { ApiError } from '../api/errors'
import type { Outcome } from '../api/types'
import { arranged, detour, type FoundEpisodes, type Order, OUTCOMES, tally } from '../lib/episodes'
import { count } from '../lib/format'
import { useArrangement } from '../lib/useArrangement'
import table from './ExperimentTable.module.css'
import { IconPlayerPlay } from './icons'
import { Segments } from './Segments'
import { Message, QueryError } from './ui'
import ui from './ui.module.css'

/** Rows at first, and with every press of the button. */
const ROWS = 25

interface EpisodesProps {
  found: FoundEpisodes
  onReplay: (episode: number) => void
}

export function Episodes({ found: whole, onReplay }: EpisodesProps) {
  const { episodes } = whole
  const [{ outcome: filter, order, reversed }, arrange] = useArrangement()
  const [rows, setRows] = useState(ROWS)
  const found = arranged(whole, order, reversed).filter(
    ({ outcome }) => filter === 'all' || outcome === filter,
  )
  const maps = new Set(whole.maps).size > 1
  const spl = (whole.spl?.length ?? 0) > 0
  const head = (by: Order, title: string, look: Omit<HeadProps, 'sorted' | 'onSort' | 'title'> = {}) => (
    <Head
      {...look}
      title={title}
      sorted={order !== by ? 'none' : reversed ? 'descending' : 'ascending'}
      onSort={() => {
        const back = order === by && reversed
        arrange({ order: back ? 'interest' : by, reversed: order === by && !reversed })
        setRows(ROWS)
      }}
    />
  )
  return (
    <div data-testid="episodes">
      <Group px="md" pb="sm" gap="sm">
        <Segments
          size="xs"
          aria-label="Outcome"
          value={filter}
          onChange={(next) => {
            arrange({ outcome: next })
            setRows(ROWS)
          }}
          data={[
            { value: 'all', label: `All ${count(episodes.length)}` },
            ...tally(episodes).map(([outcome, many]) => ({
              value: outcome,
              label: `${OUTCOMES[outcome].many} ${count(many)}`,
            })),
          ]}
        />
        <Text size="xs" c="dimmed">
          {order !== 'interest'
            ? reversed
              ? 'The best first.'
              : 'The worst first.'
            : filter === 'all'
              ? 'Failures first, then the narrowest.'
              : 'The narrowest first.'}
        </Text>
      </Group>
      <Table.ScrollContainer type="native" minWidth={340}>
        <Table highlightOnHover className={table.table}>
          <Table.Thead>
            <Table.Tr>
              {head('episode', 'Episode', { ta: 'right', w: 84 })}
              {maps && head('map', 'Map', { visibleFrom: 'md' })}
              {head('outcome', 'Outcome')}
              {head('steps', 'Steps', NUMBER)}
              {head('path', 'Path', WIDE)}
              {head('detour', 'Of the shortest', WIDE)}
              {spl && head('spl', 'SPL', WIDE)}
              {head('clearance', 'Clearance', WIDE)}
              <Table.Th w={120}>
                <VisuallyHidden>Replay</VisuallyHidden>
              </Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {found.slice(0, rows).map((episode) => (
              <Table.Tr key={episode.index} data-testid="episode" data-outcome={episode.outcome}>
                <Table.Td ta="right" fw={550} className={ui.number}>
                  {count(episode.index + 1)}
                </Table.Td>
                {maps && (
                  <Table.Td visibleFrom="md" className={ui.quiet}>
                    {episode.map}
                  </Table.Td>
                )}
                <Table.Td>
                  <OutcomeLabel outcome={episode.outcome} />
                </Table.Td>
                <Table.Td ta="right" className={ui.number}>
                  {count(episode.steps)}
                </Table.Td>
                <Table.Td ta="right" className={ui.number} visibleFrom="sm">
                  {episode.path_length.toFixed(1)} m
                </Table.Td>
                <Table.Td ta="right" className={`${ui.number} ${ui.quiet}`} visibleFrom="sm">
                  {factor(detour(episode))}
                </Table.Td>
                {spl && (
                  <Table.Td ta="right" className={ui.number} visibleFrom="sm">
                    {(episode.spl ?? 0).toFixed(2)}
                  </Table.Td>
                )}
                <Table.Td
                  ta="right"
                  className={ui.number}
                  visibleFrom="sm"
                  title="Smallest distance between the body and anything"
                >
                  {episode.min_clearance.toFixed(2)} m
                </Table.Td>
                <Table.Td ta="right">
                  <Button
                    size="compact-sm"
                    variant="default"
                    leftSection={<IconPlayerPlay size={13} />}
                    aria-label={`Replay episode ${episode.index + 1}`}
                    onClick={() => onReplay(episode.index)}
                  >
                    Replay
                  </Button>
                </Table.Td>
              </Table.Tr>
            ))}
          </Table.Tbody>
        </Table>
        {found.length > rows && (
          <Group justify="center" py="sm">
            <Button variant="default" size="xs" onClick={() => setRows(rows + 4 * ROWS)}>
              Show more of {count(found.length)} episodes
            </Button>
          </Group>
        )}
      </Table.ScrollContainer>
    </div>
  )
}

const NUMBER = { ta: 'right' } as const
const WIDE = { ta: 'right', visibleFrom: 'sm' } as const

interface HeadProps {
  title: string
  sorted: 'none' | 'ascending' | 'descending'
  onSort: () => void
  ta?: 'right'
  w?: number
  visibleFrom?: 'sm' | 'md'
}

/** A column's head: pressed once it has the worst first, twice the best, and once more all is as it was. */
function Head({ title, sorted, onSort, ...look }: HeadProps) {
  return (
    <Table.Th aria-sort={sorted} {...look}>
      <UnstyledButton fz="inherit" fw="inherit" c="inherit" onClick={onSort}>
        {title}
        {sorted === 'none' ? '' : sorted === 'ascending' ? ' ↑' : ' ↓'}
      </UnstyledButton>
    </Table.Th>
  )
}

const factor = (value: number | null) => (value === null ? '–' : `${value.toFixed(2)} ×`)

/** How an episode ended: a dot and a word. */
export function OutcomeLabel({ outcome }: { outcome: Outcome }) {
  const { label, color } = OUTCOMES[outcome]
  return (
    <span className={ui.state} style={{ '--state-color': color } as React.CSSProperties}>
      <span className={ui.dot} />
      {label}
    </span>
  )
}

interface EpisodesQueryProps {
  query: { data?: FoundEpisodes | undefined; error: unknown; refetch: () => unknown }
  onReplay: (episode: number) => void
}

/** The episodes once they have come. */
export function EpisodesQuery({ query, onReplay }: EpisodesQueryProps) {
  if (query.data) return <Episodes found={query.data} onReplay={onReplay} />
  if (query.error instanceof ApiError && query.error.status === 404)
    return <Message title="Not measured">There are no episodes of this policy.</Message>
  if (query.error)
    return <QueryError error={query.error} what="episodes" retry={() => void query.refetch()} />
  return <Skeleton height={160} m="md" w="auto" />
}
