/** The episodes of an evaluation, failures first, each with its replay. */
import { Button, Group, Skeleton, Table, Text, VisuallyHidden } from '@mantine/core'
import { useState } from 'react'
import { ApiError } from '../api/errors'
import type { EpisodeResult, Outcome } from '../api/types'
import { byInterest, detour, OUTCOMES, tally } from '../lib/episodes'
import { count } from '../lib/format'
import table from './ExperimentTable.module.css'
import { IconPlayerPlay } from './icons'
import { Segments } from './Segments'
import { Message, QueryError } from './ui'
import ui from './ui.module.css'

/** Rows at first, and with every press of the button. */
const ROWS = 25

interface EpisodesProps {
  episodes: readonly EpisodeResult[]
  onReplay: (episode: number) => void
}

export function Episodes({ episodes, onReplay }: EpisodesProps) {
  const [filter, setFilter] = useState<Outcome | 'all'>('all')
  const [rows, setRows] = useState(ROWS)
  const found = byInterest(episodes).filter(({ outcome }) => filter === 'all' || outcome === filter)
  return (
    <div data-testid="episodes">
      <Group px="md" pb="sm" gap="sm">
        <Segments
          size="xs"
          aria-label="Outcome"
          value={filter}
          onChange={(next) => {
            setFilter(next)
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
          {filter === 'all' ? 'Failures first, then the narrowest.' : 'The narrowest first.'}
        </Text>
      </Group>
      <Table.ScrollContainer type="native" minWidth={340}>
        <Table highlightOnHover className={table.table}>
          <Table.Thead>
            <Table.Tr>
              <Table.Th ta="right" w={84}>
                Episode
              </Table.Th>
              <Table.Th>Outcome</Table.Th>
              <Table.Th ta="right">Steps</Table.Th>
              <Table.Th ta="right" visibleFrom="sm">
                Path
              </Table.Th>
              <Table.Th ta="right" visibleFrom="sm">
                Of the shortest
              </Table.Th>
              <Table.Th ta="right" visibleFrom="sm">
                Clearance
              </Table.Th>
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
  query: { data?: { episodes: EpisodeResult[] } | undefined; error: unknown; refetch: () => unknown }
  onReplay: (episode: number) => void
}

/** The episodes once they have come. */
export function EpisodesQuery({ query, onReplay }: EpisodesQueryProps) {
  if (query.data) return <Episodes episodes={query.data.episodes} onReplay={onReplay} />
  if (query.error instanceof ApiError && query.error.status === 404)
    return <Message title="Not measured">There are no episodes of this policy.</Message>
  if (query.error)
    return <QueryError error={query.error} what="episodes" retry={() => void query.refetch()} />
  return <Skeleton height={160} m="md" w="auto" />
}
