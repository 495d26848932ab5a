/** Who is signed in; without accounts everybody is the owner of the server's token, and nothing of people is shown. */
import { $api } from './client'

export function useAccount(enabled = true) {
  return $api.useQuery('get', '/api/account', undefined, { enabled, staleTime: 30_000 })
}
