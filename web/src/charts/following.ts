/** Curves while runs go on, a run's own and a comparison's: after the first answer only what is new is asked for. */
import { keepPreviousData, queryOptions } from '@tanstack/react-query'
import { api } from '../api/client'
import type { paths } from '../api/schema'
import type { Curves, Metrics, Series } from '../api/types'
import { useInSlices } from '../api/useInSlices'

/** A series grows to so many times the width that was asked for; then it is asked for whole, in fewer points. */
const MOST_WIDTHS = 2

/** What is known, up to the step from which on the news tells; the news from there on. */
export function followed(known: Metrics, news: Metrics): Metrics {
  const { since } = news
  if (since === null) return news
  const fresh = new Map(news.series.map((one) => [one.name, one]))
  const grown = known.series.map((one) => {
    const next = fresh.get(one.name)
    fresh.delete(one.name)
    return next ? joined(one, next, since) : one
  })
  const series = [...grown, ...fresh.values()].sort((a, b) => (a.name < b.name ? -1 : 1))
  return { ...news, series }
}

function joined(known: Series, next: Series, since: number): Series {
  let kept = known.steps.length
  while (kept > 0 && (known.steps[kept - 1] ?? 0) >= since) kept--
  const edge = (name: 'min' | 'max') =>
    known[name] === null && next[name] === null
      ? null
      : [...(known[name] ?? known.values).slice(0, kept), ...(next[name] ?? next.values)]
  return {
    name: known.name,
    steps: [...known.steps.slice(0, kept), ...next.steps],
    values: [...known.values.slice(0, kept), ...next.values],
    min: edge('min'),
    max: edge('max'),
  }
}

/** The newest step of what is known; undefined where all should be asked for anew. */
export function newest(known: Metrics | undefined, points: number): number | undefined {
  if (!known || known.series.some(({ steps }) => steps.length > MOST_WIDTHS * points)) return undefined
  const steps = known.series.flatMap((one) => one.steps.at(-1) ?? [])
  return steps.length > 0 ? Math.max(...steps) : undefined
}

/** The question for all series of a run, each of some `points` points. */
export function curvesOf(runId: string, points: number) {
  const path = '/api/runs/{run_id}/metrics'
  const params = { path: { run_id: runId }, query: { points } }
  return queryOptions({
    // As the typed client's own, by which the stream of changes finds it.
    queryKey: ['get', path, { params }],
    queryFn: async ({ client, queryKey, signal }) => {
      const known = client.getQueryData<Metrics>(queryKey)
      const since = newest(known, points)
      const query = known && since !== undefined ? { points, since, attempt: known.attempt } : { points }
      const { data } = await api.GET(path, { params: { path: params.path, query }, signal })
      // A refusal has been thrown.
      const news = data as Metrics
      return known ? followed(known, news) : news
    },
  })
}

/** The answer to it. */
export const useCurves = (runId: string, points: number) =>
  useInSlices({ ...curvesOf(runId, points), placeholderData: keepPreviousData })

type Experiment = Curves['experiments'][number]

/** What is known, up to the place of the grid beyond which the news tells; the news from there on. */
export function followedCurves(known: Curves, news: Curves): Curves {
  const { since } = news
  if (since === null) return news
  let kept = known.steps.length
  while (kept > 0 && (known.steps[kept - 1] ?? 0) > since) kept--
  const behind = <Value>(before: readonly Value[], after: readonly Value[]) => [
    ...before.slice(0, kept),
    ...after,
  ]
  const experiments = news.experiments.map((next, index): Experiment => {
    const before = known.experiments[index]
    if (!before) return next
    return {
      ...next,
      seeds: next.seeds.map((seed, place) => ({
        ...seed,
        values: behind(before.seeds[place]?.values ?? [], seed.values),
      })),
      mean: behind(before.mean, next.mean),
      low: behind(before.low, next.low),
      high: behind(before.high, next.high),
      count: behind(before.count, next.count),
    }
  })
  return { ...news, steps: behind(known.steps, news.steps), experiments }
}

/** With what to ask for what is new; undefined where all should be asked for anew. */
export function follow(known: Curves | undefined, points: number): string | undefined {
  if (!known || known.steps.length > MOST_WIDTHS * points) return undefined
  return known.follow ?? undefined
}

type CurvesQuery = paths['/api/compare/curves']['get']['parameters']['query'] & { points: number }

/** One metric of several experiments on one grid; drawn in slices, as every answer (`$api`). */
export function useComparedCurves(query: CurvesQuery, placeholderData: typeof keepPreviousData) {
  const path = '/api/compare/curves'
  return useInSlices({
    queryKey: ['get', path, { params: { query } }],
    queryFn: async ({ client, queryKey, signal }) => {
      const known = client.getQueryData<Curves>(queryKey)
      const since = follow(known, query.points)
      const asked = since === undefined ? query : { ...query, since }
      const { data } = await api.GET(path, { params: { query: asked }, signal })
      // A refusal has been thrown.
      const news = data as Curves
      return known ? followedCurves(known, news) : news
    },
    placeholderData,
  })
}
