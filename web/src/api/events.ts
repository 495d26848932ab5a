/** The server's change stream: tells which queries to ask again. REST is the truth; an event carries no values. */
import type { QueryClient } from '@tanstack/react-query'
import { useQueryClient } from '@tanstack/react-query'
import { useEffect } from 'react'
import { at } from '../lib/base'
import { positionOfFirstAnswer } from './client'

export interface Change {
  /** Null for one that this page does not show. */
  experiment_id: string | null
  run_id: string | null
  kind: 'run' | 'metrics' | 'checkpoint' | 'experiment' | 'deleted'
}

/** At least this long from one question to the same again, however fast the changes come. */
export const ROUND_MS = 1_000
/** The same where runs that report move figures of many: a list's progress, a comparison's curves. */
export const SLOW_ROUND_MS = 5_000
const SLOW_PATHS: readonly unknown[] = ['/api/experiments', '/api/workbench/groups', '/api/compare/curves']
/** What takes the server long to answer is left alone for so many times as long. */
const REST = 3
const TICK_MS = 250
/** A page whose queries have not changed for so long is the one that the stream follows. */
export const SETTLE_MS = 200
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
  const ofRun =
    (change.run_id === null && change.experiment_id !== null) || params?.path?.run_id === change.run_id
  const ofExperiment = params?.path?.experiment_id === change.experiment_id
  const ofCompared =
    change.experiment_id !== null && (params?.query?.experiment ?? []).includes(change.experiment_id)
  if (path === '/api/experiments') return true
  if (path === '/api/workbench/groups') return true
  // What there is to filter by grows with launches.
  if (path === '/api/workbench/keys' || path === '/api/workbench/values') return change.kind === 'experiment'
  // Thirty runs report several times a second: while they go on, their page asks at its own pace.
  if (path === '/api/reproduction') return change.kind !== 'metrics'
  if (path === '/api/status' || path === '/api/queue' || path === '/api/workers')
    return change.kind !== 'metrics'
  if (path.startsWith('/api/experiments/{experiment_id}')) return ofExperiment
  if (path === '/api/compare' || path === '/api/compare/metrics') {
    return change.kind !== 'metrics' && ofCompared
  }
  if (path === '/api/compare/curves') return ofCompared
  if (path === '/api/runs/{run_id}') return ofRun
  if (path === '/api/runs/{run_id}/metrics') return ofRun && change.kind !== 'checkpoint'
  if (path === '/api/runs/{run_id}/log') return ofRun && change.kind !== 'metrics'
  // Diagnoses read whole curves: while a run goes on, they are asked for at their own pace.
  if (path === '/api/runs/{run_id}/diagnoses') return ofRun && change.kind !== 'metrics'
  if (path === '/api/runs/{run_id}/checkpoints') return ofRun && change.kind !== 'metrics'
  if (path === '/api/runs/{run_id}/checkpoints/steps') return ofRun && change.kind === 'checkpoint'
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
  /** Milliseconds until a query may be asked again, 0 or more. */
  const dueIn = (queryHash: string, urgent: boolean) => {
    const query = cache.get(queryHash)
    if (query?.state.fetchStatus === 'fetching') return TICK_MS
    const times = asked.get(queryHash)
    if (!times) return 0
    const least = !urgent && SLOW_PATHS.includes(query?.queryKey[1]) ? SLOW_ROUND_MS : ROUND_MS
    const due = Math.max(times.at + least, times.answered + REST * (times.answered - times.at))
    return Math.max(0, due - Date.now())
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
    const waits = [...old].map(([hash, urgent]) => [hash, dueIn(hash, urgent)] as const)
    const due = new Set(waits.filter(([, wait]) => wait === 0).map(([hash]) => hash))
    for (const hash of due) old.delete(hash)
    // Changes that come meanwhile are looked at with the next of these.
    timer = setTimeout(flush, Math.min(TICK_MS, ...waits.map(([, wait]) => wait || TICK_MS)))
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
 * Where the stream of the queries that are shown now is: what they are about is told in full, of everything else only which
 * kinds of change there were.
 */
export function streamPath(client: QueryClient, since: string | undefined): string {
  const shown = new Set<string>()
  for (const query of client.getQueryCache().findAll({ type: 'active' })) {
    const [, path, init] = query.queryKey
    const { params } = (init ?? {}) as Parameters
    if (path === '/api/experiments' || path === '/api/workbench/groups') shown.add('reports=true')
    const { experiment_id, run_id } = params?.path ?? {}
    if (run_id) shown.add(`run=${encodeURIComponent(run_id)}`)
    for (const id of [experiment_id, ...(params?.query?.experiment ?? [])]) {
      if (id) shown.add(`experiment=${encodeURIComponent(id)}`)
    }
  }
  const what = ['follow=shown', ...[...shown].sort()].join('&')
  return at(`/api/events?${what}${since === undefined ? '' : `&since=${encodeURIComponent(since)}`}`)
}

/**
 * Keeps one stream open while the tab is visible: browsers allow six connections to an HTTP/1.1 server, so a hidden tab
 * lets go of its own. It follows what the page shows; where it is opened anew, what was missed meanwhile is told first, or
 * that too much was missed to tell, and then everything is asked for again.
 */
export function useServerEvents(enabled: boolean): void {
  const client = useQueryClient()
  useEffect(() => {
    if (!enabled) return
    const invalidator = createInvalidator(client)
    let source: EventSource | undefined
    let retry: ReturnType<typeof setTimeout> | undefined
    let settling: ReturnType<typeof setTimeout> | undefined
    let failures = 0
    let position = positionOfFirstAnswer()
    let followed = ''
    const open = () => {
      followed = streamPath(client, undefined)
      const opened = new EventSource(streamPath(client, position))
      source = opened
      const hear = (name: string, act: (data: string) => void) =>
        opened.addEventListener(name, (event: MessageEvent<string>) => {
          position = event.lastEventId
          act(event.data)
        })
      hear('opened', () => {
        failures = 0
      })
      hear('resync', () => void client.invalidateQueries())
      hear('changes', (data) => {
        for (const change of JSON.parse(data) as Change[]) invalidator.push(change)
      })
      // A connection that drops the browser takes up again; after a refusal, say of a proxy whose server restarts, it does not.
      opened.onerror = () => {
        if (opened !== source || opened.readyState !== CLOSED) return
        source = undefined
        retry = setTimeout(open, Math.min(FIRST_RETRY_MS * 2 ** failures, LAST_RETRY_MS))
        failures += 1
      }
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
    // A page that opens shows its queries one after another.
    const unsubscribe = client.getQueryCache().subscribe(({ type }) => {
      if (type !== 'observerAdded' && type !== 'observerRemoved') return
      clearTimeout(settling)
      settling = setTimeout(() => {
        if (source !== undefined && streamPath(client, undefined) !== followed) follow()
      }, SETTLE_MS)
    })
    follow()
    document.addEventListener('visibilitychange', follow)
    return () => {
      document.removeEventListener('visibilitychange', follow)
      unsubscribe()
      clearTimeout(settling)
      close()
      invalidator.stop()
    }
  }, [client, enabled])
}
