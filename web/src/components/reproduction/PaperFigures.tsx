/** The learning curves in the arrangement of the paper's figures: each seed thin, the mean bold, its interval a band. */
import { Text } from '@mantine/core'
import { keepPreviousData } from '@tanstack/react-query'
import { useEffect, useMemo } from 'react'
import { $api } from '../../api/client'
import type { CampaignRow, PaperFigure, Reproduction } from '../../api/types'
import { MetricChart } from '../../charts/MetricChart'
import charts from '../../charts/MetricChart.module.css'
import { chartOfCurves } from '../../charts/shape'
import { wordsOf } from '../../charts/words'
import { compact } from '../../lib/format'
import { isActive } from '../states'
import { Panel } from '../ui'

const POINTS = 150
/** Between two looks at curves that grow: each reads up to fifteen runs. */
const EVERY_MS = 10_000
/** A method has one colour in all figures. */
const COLORS = ['ResBlock PPO', 'DDPG', 'Vanilla PPO', 'DDPG, logit penalty']

export function PaperFigures({ reproduction }: { reproduction: Reproduction }) {
  return (
    <Panel
      title="Learning curves"
      actions={
        <Text size="xs" c="dimmed">
          thin: single seeds · bold: their mean · band: 95 % interval over seeds
        </Text>
      }
    >
      <div className={charts.grid}>
        {reproduction.figures.map((figure) => (
          <Figure
            key={figure.id}
            figure={figure}
            metric={reproduction.curve}
            active={reproduction.campaign !== null && isActive(reproduction.campaign.state)}
            rows={reproduction.rows.filter((row) => figure.rows.includes(row.id))}
          />
        ))}
      </div>
      <Text size="xs" c="dimmed" mt="sm">
        Reward summed over a target attempt while training, exploration included. The paper calls it
        cumulative reward and draws one run of each.
      </Text>
    </Panel>
  )
}

interface FigureProps {
  figure: PaperFigure
  metric: string
  active: boolean
  rows: readonly CampaignRow[]
}

function Figure({ figure, metric, active, rows }: FigureProps) {
  const experiments = rows.flatMap((row) => row.experiment_id ?? [])
  const done = rows.flatMap((row) => row.runs).filter((run) => run.measured !== null).length
  const { data, error, refetch } = $api.useQuery(
    'get',
    '/api/compare/curves',
    { params: { query: { experiment: experiments, name: metric, points: POINTS } } },
    {
      placeholderData: keepPreviousData,
      enabled: experiments.length > 0,
      meta: { ownPace: true },
      refetchInterval: active ? EVERY_MS : false,
    },
  )
  // The last points of a training come with its result.
  // biome-ignore lint/correctness/useExhaustiveDependencies: `done` is what to ask again for.
  useEffect(() => {
    if (experiments.length > 0) void refetch()
  }, [done, refetch])
  const chart = useMemo(() => {
    const methods = new Map(rows.map((row) => [row.experiment_id, row.method]))
    return data
      ? chartOfCurves(data, ({ id, name }) => {
          const method = methods.get(id) ?? name
          return { name: method, color: Math.max(0, COLORS.indexOf(method)), dash: 0 }
        })
      : { x: [], lines: [] }
  }, [data, rows])
  return (
    <MetricChart
      title={figure.title}
      data={chart}
      y={wordsOf(metric).axis}
      format={compact}
      smoothable
      empty={error && !data ? 'Could not be loaded' : 'No value yet'}
    />
  )
}
