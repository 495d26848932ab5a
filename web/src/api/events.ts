/** The server's change stream: tells which queries to ask again. REST is the truth; an event carries no values. */
import type { QueryClient } from '@tanstack/react-query'
import { useQueryClient } from '@tanstack/react-query'
import { useEffect } from 'react'

export interface Change {
  experiment_id: string
  run_id: string | null
  kind: 'run' | 'metrics' | 'checkpoint' | 'experiment' | 'deleted'
}

/** At least this long from one question to the same again, however fast the changes come. */
export const ROUND_MS = 1_000
/** The same where runs that report move figures of many: a list's progress, a comparison's curves. */
export const SLOW_ROUND_MS = 5_000
const SLOW_PATHS: readonly unknown[] = ['/api/experiments', '/api/compare/curves']
/** What takes the server long to answer is left alone for so many times as long. */
const REST = 3
const TICK_MS = 250
const FIRST_RETRY_MS = 1_000
const LAST_RETRY_MS = 30_000
/** EventSource.CLOSED, which a browser never opens again by itself. */
const CLOSED = 2

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
 * Collects changes and asks again what they make old: at once where it was not asked lately, and never while the answer to
 * the last question is on its way, which it would throw away. A query with `meta: { ownPace: true }` asks again by itself.
 */
export function createInvalidator(client: QueryClient): { push: (change: Change) => void; stop: () => void } {
  const cache = client.getQueryCache()
  let pending: Change[] = []
  let timer: ReturnType<typeof setTimeout> | undefined
  /** The queries whose answer is old, and whether by more than newly reported values. */
  const old = new Map<string, boolean>()
  const asked = new Map<string, { at: number; answered: number }>()
  const unsubscribe = cache.subscribe((event) => {
    const { queryHash } = event.query
    if (event.type === 'removed') {
      old.delete(queryHash)
      asked.delete(queryHash)
    } else if (event.type === 'updated') {
      const { type } = event.action
      const times = asked.get(queryHash)
      if (type === 'fetch') asked.set(queryHash, { at: Date.now(), answered: 0 })
      else if ((type === 'success' || type === 'error') && times?.answered === 0) times.answered = Date.now()
    }
  })
  const isDue = (queryHash: string, urgent: boolean) => {
    const query = cache.get(queryHash)
    if (query?.state.fetchStatus === 'fetching') return false
    const times = asked.get(queryHash)
    if (!times) return true
    const least = !urgent && SLOW_PATHS.includes(query?.queryKey[1]) ? SLOW_ROUND_MS : ROUND_MS
    return Date.now() >= Math.max(times.at + least, times.answered + REST * (times.answered - times.at))
  }
  const flush = () => {
    timer = undefined
    for (const { meta, queryHash, queryKey } of pending.length > 0 ? cache.getAll() : []) {
      const changes = meta?.ownPace === true ? [] : pending.filter((change) => concerns(change, queryKey))
      if (changes.length === 0) continue
      old.set(queryHash, old.get(queryHash) === true || changes.some(({ kind }) => kind !== 'metrics'))
    }
    pending = []
    if (old.size === 0) return
    const due = new Set([...old].filter(([hash, urgent]) => isDue(hash, urgent)).map(([hash]) => hash))
    for (const hash of due) old.delete(hash)
    timer = setTimeout(flush, TICK_MS)
    if (due.size > 0) {
      void client.invalidateQueries(
        { predicate: ({ queryHash }) => due.has(queryHash) },
        { cancelRefetch: false },
      )
    }
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
      old.clear()
      unsubscribe()
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
    let retry: ReturnType<typeof setTimeout> | undefined
    let failures = 0
    let openedBefore = false
    const open = () => {
      const opened = new EventSource('/api/events')
      source = opened
      opened.onopen = () => {
        failures = 0
        if (openedBefore) void client.invalidateQueries()
        openedBefore = true
      }
      // A connection that drops the browser takes up again; after a refusal, say of a proxy whose server restarts, it does not.
      opened.onerror = () => {
        if (opened !== source || opened.readyState !== CLOSED) return
        source = undefined
        retry = setTimeout(open, Math.min(FIRST_RETRY_MS * 2 ** failures, LAST_RETRY_MS))
        failures += 1
      }
      opened.addEventListener('change', (event) => invalidator.push(JSON.parse(event.data) as Change))
    }
    const close = () => {
      clearTimeout(retry)
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
