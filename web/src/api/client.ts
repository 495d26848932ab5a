/** The typed client of the server's API: types generated from its OpenAPI, errors as classes, queries with defaults. */
import {
  InfiniteQueryObserver,
  MutationCache,
  QueryCache,
  QueryClient,
  type QueryFunction,
  type QueryFunctionContext,
  type QueryKey,
  useQueryClient,
} from '@tanstack/react-query'
import createFetchClient from 'openapi-fetch'
import createQueryHooks from 'openapi-react-query'
import { BASE } from '../lib/base'
import { earlyAnswer } from '../lib/early'
import { ApiError, errorOf, isUnauthorized, OfflineError } from './errors'
import type { paths } from './schema'
import { useInSlices } from './useInSlices'

export const api = createFetchClient<paths>({
  baseUrl: window.location.origin + BASE,
  // Looked up at each call, so that a test can stand in for the network.
  fetch: (request) => earlyAnswer(request) ?? globalThis.fetch(request),
})

let firstPosition: string | undefined

/** From when the oldest of this page's answers is: whoever listens from there on misses no change to any of them. */
export const positionOfFirstAnswer = () => firstPosition

/** Answers come in another order than they were given in. Positions are "START-COUNT", of one start of the server counted up. */
function older(one: string | undefined, other: string | undefined): string | undefined {
  if (!one || !other) return one ?? other
  const [start, count] = one.split('-')
  const [otherStart, otherCount] = other.split('-')
  return start === otherStart && Number(otherCount) < Number(count) ? other : one
}

api.use({
  async onResponse({ response }) {
    firstPosition = older(firstPosition, response.headers.get('Mapless-Position') ?? undefined)
    if (!response.ok) throw await errorOf(response)
  },
  onError({ error }) {
    return error instanceof DOMException && error.name === 'AbortError' ? error : new OfflineError()
  },
})

/** The hooks as they come: for what has to be told at once, and for whether a question is under way. */
export const $now = createQueryHooks(api)

/**
 * The same for the pages. What has been answered is drawn in slices, between which the browser answers: a long list holds up
 * nobody who types or presses. Of a question's state it tells what `useInSlices` does.
 */
export const $api: typeof $now = {
  ...$now,
  useQuery: ((...[method, path, init, options, given]: Parameters<typeof $now.useQuery>) => {
    const asked = $now.queryOptions(method, path, init as never, options as never)
    useAskedAtOnce(asked, (client) => client.query(asked), given)
    return useInSlices(asked, given)
  }) as typeof $now.useQuery,
  useInfiniteQuery: ((...[method, path, init, options, given]: Parameters<typeof $now.useInfiniteQuery>) => {
    const asked = inParts(method, path, init, options)
    useAskedAtOnce(asked, (client) => client.infiniteQuery(asked), given)
    return useInSlices(asked as never, given, InfiniteQueryObserver as never)
  }) as unknown as typeof $now.useInfiniteQuery,
}

/** Sends a new question while the page is drawn: React sends it once all is drawn, half a second later on a slow phone. */
function useAskedAtOnce(
  { queryKey, enabled }: { queryKey: QueryKey; enabled?: unknown },
  ask: (client: QueryClient) => Promise<unknown>,
  given?: QueryClient,
) {
  const client = useQueryClient(given)
  if (enabled === false || client.getQueryState(queryKey)) return
  // How it ends, whoever asked is told by the cache.
  ask(client).catch(() => {})
}

/** The question for a list in parts, as openapi-react-query asks it. */
function inParts(...[method, path, init, options]: Parameters<typeof $now.useInfiniteQuery>) {
  const { queryKey, queryFn } = $now.queryOptions(method, path, init as never)
  const { pageParamName = 'cursor', ...rest } = options
  const asked = init as { params: { query: object } }
  const part = (pageParam: unknown) => ({
    ...asked,
    params: { ...asked.params, query: { ...asked.params.query, [pageParamName]: pageParam } },
  })
  return {
    ...(rest as { enabled?: boolean; initialPageParam: unknown; getNextPageParam: () => unknown }),
    queryKey,
    queryFn: ({ pageParam, ...context }: QueryFunctionContext<typeof queryKey, unknown>) =>
      (queryFn as unknown as QueryFunction)({
        ...context,
        queryKey: [method, path, part(pageParam)],
      } as never),
  }
}

const statusKey = ['get', '/api/status'] as const

/** A client for one page load. Whatever is refused with 401 makes the status query ask again, and with it the login. */
export function createQueryClient(): QueryClient {
  const onError = (error: unknown) => {
    if (isUnauthorized(error)) void client.invalidateQueries({ queryKey: statusKey })
  }
  const client = new QueryClient({
    queryCache: new QueryCache({
      onError: (error, query) => {
        if (query.queryKey[1] !== statusKey[1]) onError(error)
      },
    }),
    mutationCache: new MutationCache({ onError }),
    defaultOptions: {
      queries: {
        // The server is often this very machine: a laptop without a network still reaches it.
        networkMode: 'always',
        staleTime: 2_000,
        refetchOnReconnect: false,
        // A refusal stays one; a server that restarts is worth waiting for.
        retry: (failures, error) => !(error instanceof ApiError && error.status < 500) && failures < 2,
        retryDelay: (failures) => Math.min(500 * 2 ** failures, 4_000),
      },
      mutations: { networkMode: 'always', retry: false },
    },
  })
  return client
}
