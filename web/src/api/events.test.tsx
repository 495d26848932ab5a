import { QueryClient, QueryClientProvider } from '@tanstack/react-query'
import { act, renderHook } from '@testing-library/react'
import type { ReactNode } from 'react'
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { FakeEventSource } from '../testing/server'
import { type Change, concerns, createInvalidator, ROUND_MS, useServerEvents } from './events'

const change = (kind: Change['kind'], run_id: string | null = 'run1'): Change => ({
  experiment_id: 'exp1',
  run_id,
  kind,
})
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
    [change('run'), key('/api/runs/{run_id}/events', ofRun), true],
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

  test('the first change is acted on at once, what follows in rounds', () => {
    const invalidator = createInvalidator(client)
    for (let i = 0; i < 50; i++) invalidator.push(change('metrics'))
    expect(asked).toHaveBeenCalledTimes(1)
    vi.advanceTimersByTime(ROUND_MS)
    expect(asked).toHaveBeenCalledTimes(2)
    vi.advanceTimersByTime(10 * ROUND_MS)
    expect(asked).toHaveBeenCalledTimes(2)
    invalidator.push(change('metrics'))
    expect(asked).toHaveBeenCalledTimes(3)
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

  test('after a reconnection everything is asked again: what was missed is not repeated', () => {
    renderHook(() => useServerEvents(true), { wrapper })
    FakeEventSource.open[0]?.onopen?.()
    expect(asked).not.toHaveBeenCalled()
    FakeEventSource.open[0]?.onopen?.()
    expect(asked).toHaveBeenCalledWith()
  })

  test('nothing is opened before there is a login', () => {
    renderHook(() => useServerEvents(false), { wrapper })
    expect(FakeEventSource.open).toHaveLength(0)
  })
})
