/** What people call the arena of a training; an imported one by the name that its file gave it. */
import { $api } from '../api/client'
import type { ArenaConfig } from '../api/types'
import { words } from '../lib/format'

export function useArenaTitle(arena: ArenaConfig): string {
  const sha256 = arena.name === 'imported' ? arena.sha256 : ''
  const { data } = $api.useQuery(
    'get',
    '/api/arenas/imported/{sha256}',
    { params: { path: { sha256 } } },
    { enabled: sha256 !== '', staleTime: 60_000, retry: false },
  )
  return data?.title ?? words(arena.name)
}
