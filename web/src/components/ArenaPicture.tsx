/** The arena of a training from above, wherever it comes from. */
import { Skeleton } from '@mantine/core'
import { $api } from '../api/client'
import type { ArenaConfig, ArenaGeometry } from '../api/types'
import { ArenaDrawing } from './ArenaDrawing'

const FOR_GOOD = { staleTime: Number.POSITIVE_INFINITY }

export function ArenaPicture({ arena }: { arena: ArenaConfig }) {
  switch (arena.name) {
    case 'simple':
    case 'complex':
      return <Fixed name={arena.name} />
    case 'imported':
      return arena.arena ? <Picture geometry={arena.arena} /> : <Imported sha256={arena.sha256} />
    default:
      return <Generated arena={arena} />
  }
}

function Fixed({ name }: { name: 'simple' | 'complex' }) {
  const { data } = $api.useQuery('get', '/api/arenas/fixed', { params: { query: { name } } }, FOR_GOOD)
  return <Picture geometry={data?.geometry} />
}

function Imported({ sha256 }: { sha256: string }) {
  const { data, isError } = $api.useQuery(
    'get',
    '/api/arenas/imported/{sha256}',
    { params: { path: { sha256 } } },
    { enabled: sha256 !== '', staleTime: 60_000, retry: false },
  )
  return sha256 === '' || isError ? null : <Picture geometry={data?.geometry} />
}

type GeneratedArena = Exclude<ArenaConfig, { name: 'simple' | 'complex' | 'imported' }>

function Generated({ arena: { name, difficulty, seed } }: { arena: GeneratedArena }) {
  const { data } = $api.useQuery(
    'get',
    '/api/arenas/generated',
    { params: { query: { name, difficulty, seed } } },
    FOR_GOOD,
  )
  return <Picture geometry={data?.geometry} />
}

function Picture({ geometry }: { geometry: ArenaGeometry | undefined }) {
  return geometry ? (
    <ArenaDrawing geometry={geometry} label="Its arena from above" />
  ) : (
    <Skeleton width="100%" height="100%" />
  )
}
