/** The server's change stream: tells which queries to ask again. REST is the truth; an event carries no values. */
import type { Query, QueryClient } from '@tanstack/react-query'
import { useQueryClient } from '@tanstack/react-query'
import { useEffect } from 'react'

export interface Change {
  experiment_id: string
  run_id: string | null
  kind: 'run' | 'metrics' | 'checkpoint' | 'experiment' | 'deleted'
}

/** At least this long between two rounds of questions, however fast the changes come. */
export const ROUND_MS = 1_000

interface Parameters {
  params?: { path?: { experiment_id?: string; run_id?: string }; query?: { experiment?: string[] } }
}

/** Whether a change makes the answer to a query old. */
export function concerns(change: Change, queryKey: readonly unknown[]): boolean {
  const [, path, init] = queryKey
  if (typeof path !== 'string') return false
  const { params } = (init ?? {}) as Parameters
  const ofRun = change.run_id === null || params?.path?.run_id === change.run_id
  const ofExperiment = params?.path?.experiment_id === change.experiment_id
  if (path === '/api/experiments') return true
  // Thirty runs report several times a second: while they go on, their page asks at its own pace.
  if (path === '/api/reproduction') return change.kind !== 'metrics'
  if (path === '/api/status') return change.kind !== 'metrics'
  if (path.startsWith('/api/experiments/{experiment_id}')) return ofExperiment
  if (path === '/api/compare') {
    return change.kind !== 'metrics' && (params?.query?.experiment ?? []).includes(change.experiment_id)
  }
  if (path === '/api/compare/curves') return (params?.query?.experiment ?? []).includes(change.experiment_id)
  if (path === '/api/runs/{run_id}') return ofRun
  if (path === '/api/runs/{run_id}/metrics') return ofRun && change.kind !== 'checkpoint'
  if (path === '/api/runs/{run_id}/events') return ofRun && change.kind !== 'metrics'
  // Diagnoses read whole curves: while a run goes on, they are asked for at their own pace.
  if (path === '/api/runs/{run_id}/diagnoses') return ofRun && change.kind !== 'metrics'
  if (path === '/api/runs/{run_id}/checkpoints') return ofRun && change.kind !== 'metrics'
  return false
}

/**
 * Collects changes and invalidates what they concern: the first at once, then at most one round every ROUND_MS. A query with
 * `meta: { ownPace: true }` asks again by itself.
 */
export function createInvalidator(client: QueryClient): { push: (change: Change) => void; stop: () => void } {
  let pending: Change[] = []
  let timer: ReturnType<typeof setTimeout> | undefined
  const flush = () => {
    timer = undefined
    if (pending.length === 0) return
    const changes = pending
    pending = []
    timer = setTimeout(flush, ROUND_MS)
    void client.invalidateQueries({
      predicate: ({ meta, queryKey }: Query) =>
        meta?.ownPace !== true && changes.some((change) => concerns(change, queryKey)),
    })
  }
  return {
    push(change) {
      pending.push(change)
      if (timer === undefined) flush()
    },
    stop() {
      clearTimeout(timer)
      timer = undefined
      pending = []
    },
  }
}

/**
 * Keeps one stream open while the tab is visible: browsers allow six connections to an HTTP/1.1 server, so a hidden tab
 * lets go of its own. What was missed meanwhile, or while the server was away, is asked for again on every (re)connection.
 */
export function useServerEvents(enabled: boolean): void {
  const client = useQueryClient()
  useEffect(() => {
    if (!enabled) return
    const invalidator = createInvalidator(client)
    let source: EventSource | undefined
    let openedBefore = false
    const open = () => {
      source = new EventSource('/api/events')
      source.onopen = () => {
        if (openedBefore) void client.invalidateQueries()
        openedBefore = true
      }
      source.addEventListener('change', (event) => invalidator.push(JSON.parse(event.data) as Change))
    }
    const close = () => {
      source?.close()
      source = undefined
    }
    const follow = () => {
      close()
      if (!document.hidden) open()
    }
    follow()
    document.addEventListener('visibilitychange', follow)
    return () => {
      document.removeEventListener('visibilitychange', follow)
      close()
      invalidator.stop()
    }
  }, [client, enabled])
}
