/** The numbers of an episode over its time, below one cursor that the picture shares. */
import { Select, Skeleton, Stack, Text } from '@mantine/core'
import { useMemo, useState } from 'react'
import type { EpisodeSeries } from '../../api/types'
import { Chart } from '../../charts/Chart'
import { LinkedCharts } from '../../charts/LinkedCharts'
import { significant } from '../../lib/format'
import { QueryError } from '../ui'
import classes from './Replay.module.css'
import { ALL, stripsOf, TITLES, termsOf } from './strips'

const HEIGHT = 118

interface ReplayChartsProps {
  query: { data?: EpisodeSeries | undefined; error: unknown; refetch: () => unknown }
  /** Seconds that the picture shows; null before it has begun. */
  time: number | null
  onSeek: (seconds: number) => void
}

export function ReplayCharts({ query, time, onSeek }: ReplayChartsProps) {
  const policies = query.data?.policies
  const [term, setTerm] = useState(ALL)
  const [pointing, setPointing] = useState(false)
  const terms = useMemo(() => termsOf(policies ?? []), [policies])
  const chosen = terms.includes(term) ? term : ALL
  const strips = useMemo(() => stripsOf(policies ?? [], chosen), [policies, chosen])
  if (query.error) return <QueryError error={query.error} what="charts" retry={() => void query.refetch()} />
  if (!policies) return <Skeleton h="100%" mih={240} />
  return (
    <LinkedCharts>
      <Stack
        gap="xs"
        data-testid="replay-charts"
        onPointerMove={() => setPointing(true)} // it may lie still where the charts appear
        onPointerLeave={() => setPointing(false)}
      >
        {strips.map(({ chart, data }) => (
          <div key={chart}>
            <div className={classes.stripTitle}>
              <Text size="xs" fw={550}>
                {TITLES[chart]}
              </Text>
              {chart === 'reward' && policies.length > 1 && (
                <Select
                  size="xs"
                  w={130}
                  aria-label="Term of the reward"
                  value={chosen}
                  onChange={(next) => setTerm(next ?? ALL)}
                  allowDeselect={false}
                  data={terms.map((name) => ({ value: name, label: name === ALL ? 'All terms' : name }))}
                />
              )}
            </div>
            <Chart
              data={data}
              label={TITLES[chart]}
              height={HEIGHT}
              x={SECONDS}
              format={threeDigits}
              at={pointing ? null : time}
              onSeek={onSeek}
            />
          </div>
        ))}
      </Stack>
    </LinkedCharts>
  )
}

const SECONDS = { title: 'Seconds', format: (value: number) => value.toFixed(1) }
const threeDigits = (value: number) => significant(value, 3)
