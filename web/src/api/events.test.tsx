import { QueryClient, QueryClientProvider, QueryObserver } from '@tanstack/react-query'
import { act, renderHook } from '@testing-library/react'
import type { ReactNode } from 'react'
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { FakeEventSource } from '../testing/server'
import {
  type Change,
  concerns,
  createInvalidator,
  ROUND_MS,
  SETTLE_MS,
  SLOW_ROUND_MS,
  useServerEvents,
} from './events'

const change = (kind: Change['kind'], run_id: string | null = 'run1'): Change => ({
  experiment_id: 'exp1',
  run_id,
  kind,
})
const elsewhere = (kind: Change['kind']): Change => ({ experiment_id: null, run_id: null, kind })
const key = (path: string, params: object = {}) => ['get', path, { params }]

describe('which questions a change makes old', () => {
  const ofRun = { path: { run_id: 'run1' } }
  const compared = { query: { experiment: ['exp0', 'exp1'] } }
  test.each<[Change, readonly unknown[], boolean]>([
    [change('metrics'), key('/api/runs/{run_id}/metrics', ofRun), true],
    [change('metrics'), key('/api/runs/{run_id}/metrics', { path: { run_id: 'run2' } }), false],
    [change('metrics'), key('/api/runs/{run_id}', ofRun), true],
    [change('metrics'), key('/api/runs/{run_id}/checkpoints', ofRun), false],
    [change('checkpoint'), key('/api/runs/{run_id}/checkpoints', ofRun), true],
    [change('metrics'), key('/api/runs/{run_id}/diagnoses', ofRun), false],
    [change('run'), key('/api/runs/{run_id}/diagnoses', ofRun), true],
    [change('run'), key('/api/runs/{run_id}/log', ofRun), true],
    [change('run', null), key('/api/runs/{run_id}', { path: { run_id: 'any' } }), true],
    [change('metrics'), key('/api/experiments'), true],
    [change('metrics'), key('/api/reproduction'), false],
    [change('run'), key('/api/reproduction'), true],
    [change('metrics'), key('/api/experiments/{experiment_id}', { path: { experiment_id: 'exp1' } }), true],
    [change('metrics'), key('/api/experiments/{experiment_id}', { path: { experiment_id: 'exp2' } }), false],
    [change('metrics'), key('/api/compare/curves', compared), true],
    [change('metrics'), key('/api/compare', compared), false],
    [change('checkpoint'), key('/api/compare', compared), true],
    [change('metrics'), key('/api/status'), false],
    [change('run'), key('/api/status'), true],
    [change('run'), key('/api/training/form'), false],
    [elsewhere('metrics'), key('/api/experiments'), true],
    [elsewhere('run'), key('/api/status'), true],
    [elsewhere('run'), key('/api/runs/{run_id}', ofRun), false],
    [elsewhere('run'), key('/api/experiments/{experiment_id}', { path: { experiment_id: 'exp1' } }), false],
    [elsewhere('checkpoint'), key('/api/compare', compared), false],
  ])('%j: %j %s', (one, queryKey, old) => expect(concerns(one, queryKey)).toBe(old))
})

describe('the stream', () => {
  let client: QueryClient
  let asked: ReturnType<typeof vi.spyOn>

  beforeEach(() => {
    vi.useFakeTimers()
    vi.stubGlobal('EventSource', FakeEventSource)
    FakeEventSource.open = []
    client = new QueryClient()
    asked = vi.spyOn(client, 'invalidateQueries')
  })

  afterEach(() => {
    vi.useRealTimers()
    setHidden(false)
  })

  const wrapper = ({ children }: { children: ReactNode }) => (
    <QueryClientProvider client={client}>{children}</QueryClientProvider>
  )

  function setHidden(hidden: boolean) {
    Object.defineProperty(document, 'hidden', { configurable: true, value: hidden })
    document.dispatchEvent(new Event('visibilitychange'))
  }

  const metricsKey = key('/api/runs/{run_id}/metrics', { path: { run_id: 'run1' } })

  /** A query that is shown, and its questions in order; the test answers them. */
  async function show(queryKey: readonly unknown[]) {
    const questions: { answer: (value: string) => void; thrownAway: boolean }[] = []
    const observer = new QueryObserver(client, {
      queryKey,
      queryFn: ({ signal }) =>
        new Promise<string>((answer) => {
          const question = { answer, thrownAway: false }
          questions.push(question)
          signal.addEventListener('abort', () => {
            question.thrownAway = true
          })
        }),
    })
    observer.subscribe(() => {})
    questions[0]?.answer('first')
    await vi.advanceTimersByTimeAsync(ROUND_MS)
    return questions
  }

  test('the first change is acted on at once, what follows in rounds', async () => {
    const invalidator = createInvalidator(client)
    const questions = await show(metricsKey)
    for (let i = 0; i < 50; i++) invalidator.push(change('metrics'))
    expect(questions).toHaveLength(2)
    questions[1]?.answer('second')
    await vi.advanceTimersByTimeAsync(ROUND_MS / 2)
    expect(questions).toHaveLength(2)
    await vi.advanceTimersByTimeAsync(ROUND_MS)
    expect(questions).toHaveLength(3)
    questions[2]?.answer('third')
    await vi.advanceTimersByTimeAsync(10 * ROUND_MS)
    expect(questions).toHaveLength(3)
  })

  test('what may be asked again is asked that moment, whenever the change came', async () => {
    const invalidator = createInvalidator(client)
    const questions = await show(metricsKey)
    invalidator.push(change('metrics'))
    questions[1]?.answer('second')
    await vi.advanceTimersByTimeAsync(330)
    invalidator.push(change('metrics'))
    await vi.advanceTimersByTimeAsync(ROUND_MS - 331)
    expect(questions).toHaveLength(2)
    await vi.advanceTimersByTimeAsync(1)
    expect(questions).toHaveLength(3)
  })

  test('an answer that is slower than the reports arrives, and what came meanwhile is asked for after it', async () => {
    const invalidator = createInvalidator(client)
    const questions = await show(metricsKey)
    invalidator.push(change('metrics'))
    for (let second = 0; second < 5; second++) {
      await vi.advanceTimersByTimeAsync(1_000)
      invalidator.push(change('metrics'))
    }
    expect(questions).toHaveLength(2)
    questions[1]?.answer('slow')
    await vi.advanceTimersByTimeAsync(0)
    expect(client.getQueryData(metricsKey)).toBe('slow')
    expect(questions[1]?.thrownAway).toBe(false)
    // It took the server five seconds: it is left alone for three times as long.
    await vi.advanceTimersByTimeAsync(14_000)
    expect(questions).toHaveLength(2)
    await vi.advanceTimersByTimeAsync(1_500)
    expect(questions).toHaveLength(3)
  })

  test('the list follows reports slowly, and a run that ends at once', async () => {
    const invalidator = createInvalidator(client)
    const questions = await show(key('/api/experiments'))
    invalidator.push(change('metrics'))
    await vi.advanceTimersByTimeAsync(2 * ROUND_MS)
    expect(questions).toHaveLength(1)
    invalidator.push(change('run'))
    await vi.advanceTimersByTimeAsync(ROUND_MS)
    expect(questions).toHaveLength(2)
    questions[1]?.answer('second')
    invalidator.push(change('metrics'))
    await vi.advanceTimersByTimeAsync(SLOW_ROUND_MS + ROUND_MS)
    expect(questions).toHaveLength(3)
  })

  test('a hidden tab lets go of its connection and takes it up again', () => {
    const { unmount } = renderHook(() => useServerEvents(true), { wrapper })
    expect(FakeEventSource.open).toHaveLength(1)
    act(() => setHidden(true))
    expect(FakeEventSource.open).toHaveLength(0)
    act(() => setHidden(false))
    expect(FakeEventSource.open).toHaveLength(1)
    unmount()
    expect(FakeEventSource.open).toHaveLength(0)
  })

  test('only what was missed for good makes everything old', () => {
    renderHook(() => useServerEvents(true), { wrapper })
    FakeEventSource.open[0]?.tell('opened', 'e-1')
    expect(asked).not.toHaveBeenCalled()
    // The browser connects again by itself, and says where it was.
    FakeEventSource.open[0]?.tell('opened', 'e-5')
    expect(asked).not.toHaveBeenCalled()
    FakeEventSource.open[0]?.tell('resync', 'e-9')
    expect(asked).toHaveBeenCalledWith()
  })

  test('the stream follows what the page shows, and goes on where it was', async () => {
    renderHook(() => useServerEvents(true), { wrapper })
    expect(FakeEventSource.open.map(({ url }) => url)).toEqual(['/api/events?follow=shown'])
    FakeEventSource.open[0]?.tell('opened', 'e-7')
    await show(key('/api/experiments'))
    await show(key('/api/runs/{run_id}/metrics', { path: { run_id: 'r1' } }))
    await show(key('/api/compare', { query: { experiment: ['b', 'a'] } }))
    await vi.advanceTimersByTimeAsync(SETTLE_MS)
    expect(FakeEventSource.open.map(({ url }) => url)).toEqual([
      '/api/events?follow=shown&experiment=a&experiment=b&reports=true&run=r1&since=e-7',
    ])
    FakeEventSource.open[0]?.send(change('run', 'r1'))
    act(() => setHidden(true))
    act(() => setHidden(false))
    expect(FakeEventSource.open[0]?.url).toMatch(/&since=e-2$/)
  })

  test('a stream that was refused is asked for again, each time later', () => {
    renderHook(() => useServerEvents(true), { wrapper })
    for (const wait of [1_000, 2_000, 4_000]) {
      const refused = FakeEventSource.open.at(-1)
      const before = FakeEventSource.open.length
      refused?.refuse()
      vi.advanceTimersByTime(wait - 1)
      expect(FakeEventSource.open).toHaveLength(before)
      vi.advanceTimersByTime(1)
      expect(FakeEventSource.open).toHaveLength(before + 1)
    }
    FakeEventSource.open.at(-1)?.tell('opened', 'e-1')
    expect(asked).not.toHaveBeenCalled()
  })

  test('nothing is opened before there is a login', () => {
    renderHook(() => useServerEvents(false), { wrapper })
    expect(FakeEventSource.open).toHaveLength(0)
  })
})
