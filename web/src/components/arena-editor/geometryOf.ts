/** The geometry of any arena of the gallery, to draw on. */
import { api } from '../../api/client'
import type { ArenaConfig, ArenaGeometry, ArenaView } from '../../api/types'
import { isFamily } from '../evaluations/choices'

export async function geometryOf(config: ArenaConfig): Promise<ArenaGeometry> {
  const { title, geometry } = await viewOf(config)
  return { ...geometry, name: `${title}, changed`.slice(0, 80) }
}

async function viewOf(config: ArenaConfig): Promise<ArenaView> {
  const { data } = isFamily(config)
    ? await api.GET('/api/arenas/generated', {
        params: { query: { name: config.name, difficulty: config.difficulty, seed: config.seed } },
      })
    : config.name === 'imported'
      ? await api.GET('/api/arenas/imported/{sha256}', { params: { path: { sha256: config.sha256 } } })
      : await api.GET('/api/arenas/fixed', { params: { query: { name: config.name } } })
  // A refusal is thrown before.
  return data as ArenaView
}
