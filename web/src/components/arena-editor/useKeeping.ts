/** Puts a drawing into the gallery, once for each state of it. */
import { useQueryClient } from '@tanstack/react-query'
import { useState } from 'react'
import { $api } from '../../api/client'
import type { ArenaConfig, ArenaGeometry, ArenaView } from '../../api/types'
import { filesForUpload } from '../../lib/upload'

export function useKeeping(arena: ArenaGeometry) {
  const client = useQueryClient()
  const [saved, setSaved] = useState<{ arena: ArenaGeometry; view: ArenaView } | null>(null)
  const upload = $api.useMutation('post', '/api/arenas/imported')
  const current = saved?.arena === arena ? saved.view : null

  /** What a task's arena must be to train on it; undefined where it was refused. */
  const keep = async (): Promise<ArenaConfig | undefined> => {
    if (current) return current.config
    try {
      const file = new File([JSON.stringify(arena)], 'drawn.json')
      const view = await upload.mutateAsync({ body: { files: await filesForUpload([file]), keep: true } })
      setSaved({ arena, view })
      await client.invalidateQueries({ queryKey: ['get', '/api/arenas'] })
      return view.config
    } catch {
      return undefined // what was wrong is `error`
    }
  }
  return { kept: current?.title ?? null, keep, pending: upload.isPending, error: upload.error }
}
