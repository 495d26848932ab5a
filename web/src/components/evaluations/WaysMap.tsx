/** Where the robots drove: every way on one map, by outcome, and where it collides most. */
import { Group, Select, Stack, Switch, Text } from '@mantine/core'
import { keepPreviousData } from '@tanstack/react-query'
import { useMemo, useState } from 'react'
import { $api } from '../../api/client'
import { isNotFound } from '../../api/errors'
import type { EvaluationWays, Outcome } from '../../api/types'
import { OUTCOMES } from '../../lib/episodes'
import { count, percent } from '../../lib/format'
import { ArenaDrawing } from '../ArenaDrawing'
import { Segments } from '../Segments'
import { Message, QueryError } from '../ui'
import { collisionCells } from './heat'
import classes from './WaysMap.module.css'

interface WaysMapProps {
  evaluationId: string
  onReplay: (episode: number) => void
}

export function WaysMap({ evaluationId, onReplay }: WaysMapProps) {
  const [arena, setArena] = useState<number | null>(null)
  const { data, error, refetch } = $api.useQuery(
    'get',
    '/api/evaluations/{evaluation_id}/ways',
    { params: { path: { evaluation_id: evaluationId }, query: arena === null ? {} : { arena } } },
    { staleTime: Number.POSITIVE_INFINITY, placeholderData: keepPreviousData, retry: false },
  )
  if (data) return <Ways ways={data} onArena={setArena} onReplay={onReplay} />
  if (isNotFound(error))
    return <Message title="Not kept">Where its robots drove takes too much room.</Message>
  if (error) return <QueryError error={error} what="map" retry={refetch} />
  return <div className={classes.frame} aria-busy="true" />
}

interface WaysProps {
  ways: Omit<EvaluationWays, 'ways'> & {
    ways: readonly { episode: number; outcome: Outcome; points: readonly (readonly number[])[] }[]
  }
  onArena: (arena: number) => void
  onReplay: (episode: number) => void
}

function Ways({ ways: { places, arena, geometry, ways }, onArena, onReplay }: WaysProps) {
  const [outcome, setOutcome] = useState<Outcome | 'all'>('all')
  const [heat, setHeat] = useState(false)
  const shown = ways.filter((way) => outcome === 'all' || way.outcome === outcome)
  const ends = useMemo(() => ways.filter((way) => way.outcome === 'collision'), [ways])
  const cells = useMemo(() => collisionCells(ends.flatMap((way) => way.points.slice(-1))), [ends])
  const counted = (Object.keys(OUTCOMES) as Outcome[])
    .map((each) => ({ each, many: ways.filter((way) => way.outcome === each).length }))
    .filter(({ many }) => many > 0)
  const unit = Math.max(geometry.width, geometry.height)
  return (
    <Stack gap="sm">
      <Group gap="sm">
        {places.length > 1 && (
          <Select
            size="xs"
            aria-label="Arena"
            searchable
            w={200}
            allowDeselect={false}
            value={String(arena)}
            onChange={(next) => next !== null && onArena(Number(next))}
            data={places.map((place) => ({
              value: String(place.arena),
              label: `Map ${place.arena + 1}: ${percent(place.arrivals / place.episodes)} of ${count(place.episodes)}`,
            }))}
          />
        )}
        <Segments
          size="xs"
          aria-label="Ways shown"
          value={outcome}
          onChange={setOutcome}
          data={[
            { value: 'all', label: `All ${count(ways.length)}` },
            ...counted.map(({ each, many }) => ({
              value: each,
              label: `${OUTCOMES[each].many} ${count(many)}`,
            })),
          ]}
        />
        {ends.length > 0 && (
          <Switch
            size="xs"
            label="Where it collides"
            checked={heat}
            onChange={(event) => setHeat(event.currentTarget.checked)}
          />
        )}
      </Group>
      <div className={classes.frame}>
        <ArenaDrawing
          geometry={{ ...geometry, start: null, target: null }}
          label={`${count(shown.length)} ways in ${geometry.name}, from above`}
        >
          {heat &&
            cells.map(({ x, y, size, share }) => (
              <rect
                key={`${x} ${y}`}
                className={classes.heat}
                x={x}
                y={y}
                width={size}
                height={size}
                opacity={0.15 + 0.75 * share}
              />
            ))}
          {shown.map((way) => (
            // biome-ignore lint/a11y/noStaticElementInteractions: the list of episodes below opens the same by keyboard.
            <g
              key={way.episode}
              className={classes.way}
              style={{ color: OUTCOMES[way.outcome].color }}
              onClick={() => onReplay(way.episode)}
            >
              <title>{`Episode ${way.episode + 1}: ${OUTCOMES[way.outcome].label}`}</title>
              <polyline points={way.points.map(([x, y]) => `${x},${y}`).join(' ')} strokeWidth={unit / 400} />
              <circle cx={way.points.at(-1)?.[0]} cy={way.points.at(-1)?.[1]} r={unit / 140} />
            </g>
          ))}
        </ArenaDrawing>
      </div>
      <Text size="xs" c="dimmed">
        {places.length > 1 && 'The arenas with the lowest success come first. '}A dot is where an episode
        ended; a click on a way replays it.
      </Text>
    </Stack>
  )
}
