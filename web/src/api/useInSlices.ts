/** A question whose answer is drawn in slices, between which the browser answers. */
import {
  notifyManager,
  type QueryClient,
  type QueryKey,
  QueryObserver,
  type UseQueryOptions,
  type UseQueryResult,
  useQueryClient,
} from '@tanstack/react-query'
import { startTransition, useEffect, useMemo, useReducer, useState } from 'react'

/** Of a question's state these are told, and what follows from them. */
const TOLD = ['data', 'error', 'status', 'isPlaceholderData'] as const

/**
 * As `useQuery` of TanStack, but for when it draws. That one keeps its state in what React calls an external store: each answer
 * draws every component that asked at once, without a break, and an answer that comes while a page is drawn has React
 * start again, without a break, too. Here an answer is a transition: a long list holds up nobody who types or presses.
 */
export function useInSlices<Answer, Failure = Error, Data = Answer, Key extends QueryKey = QueryKey>(
  options: UseQueryOptions<Answer, Failure, Data, Key>,
  given?: QueryClient,
  Observer = QueryObserver,
): UseQueryResult<Data, Failure> {
  const client = useQueryClient(given)
  const asked = client.defaultQueryOptions({ ...options, notifyOnChangeProps: [...TOLD] })
  asked._optimisticResults = 'optimistic'
  const [observer] = useState(() => new Observer(client, asked))
  const [, draw] = useReducer((times: number) => times + 1, 0)
  const result = observer.getOptimisticResult(asked)
  useEffect(() => {
    const end = observer.subscribe(notifyManager.batchCalls(() => startTransition(draw)))
    // What was answered between drawing and now; told only if the options, which ask for it too, come after.
    observer.updateResult()
    return end
  }, [observer])
  useEffect(() => observer.setOptions(asked), [observer, asked])
  const { data, error, status, isPlaceholderData } = result
  // biome-ignore lint/correctness/useExhaustiveDependencies: the result is new each time, what it says is not.
  return useMemo(() => result, [data, error, status, isPlaceholderData])
}
