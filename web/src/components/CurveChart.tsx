/** A metric of one or more experiments: seeds thin, means bold, intervals as bands. */
import { keepPreviousData } from '@tanstack/react-query'
import { useMemo } from 'react'
import { $api } from '../api/client'
import { MetricChart } from '../charts/MetricChart'
import { chartOfCurves } from '../charts/shape'
import { compact, percent } from '../lib/format'

const POINTS = 400
/** Single seeds, of all experiments together: more lines are a blur, and slow. */
const LINES = 100

/** The curves in which experiments are compared. */
export const COMPARED = [
  {
    name: 'eval/success_rate',
    title: 'Success rate',
    note: 'evaluation',
    format: percent,
    yRange: [0, 1.02] as const,
  },
  {
    name: 'train/success_rate',
    title: 'Success rate',
    note: 'training',
    format: percent,
    yRange: [0, 1.02] as const,
    smoothable: true,
  },
  { name: 'train/return', title: 'Return', note: 'per episode, training', format: compact, smoothable: true },
  { name: 'eval/steps', title: 'Steps to the target', note: 'evaluation', format: compact },
] as const

export function CurveChart({
  metric,
  experiments,
}: {
  metric: (typeof COMPARED)[number]
  experiments: readonly string[]
}) {
  const { name, ...look } = metric
  const { data, error } = $api.useQuery(
    'get',
    '/api/compare/curves',
    { params: { query: { experiment: [...experiments], name, points: POINTS, lines: LINES } } },
    { placeholderData: keepPreviousData },
  )
  const chart = useMemo(() => (data ? chartOfCurves(data) : { x: [], lines: [] }), [data])
  return (
    <MetricChart
      {...look}
      data={chart}
      empty={error && !data ? 'Could not be loaded' : data ? 'No value yet' : ''}
    />
  )
}
