/** The service at a glance, asked for every few seconds: it tells whether the server is there at all. */
import { $api } from './client'
import { isUnauthorized } from './errors'

const EVERY_MS = 5_000

export function useStatus() {
  return $api.useQuery('get', '/api/status', undefined, {
    refetchInterval: (query) => (isUnauthorized(query.state.error) ? false : EVERY_MS),
    retry: false,
  })
}
