/** Changes to a playground: what the server answers is shown at once, and a refusal is said. */
import { notifications } from '@mantine/notifications'
import { useQueryClient } from '@tanstack/react-query'
import { $api } from '../../api/client'
import { messageOf } from '../../api/errors'
import type { Playground, PlaygroundChange } from '../../api/types'

export interface GroundActions {
  change: (change: PlaygroundChange) => void
  configure: (some: Partial<Playground['settings']>) => void
}

export function useGround(ground: Playground): GroundActions {
  const client = useQueryClient()
  const init = { params: { path: { playground_id: ground.id } } }
  const { queryKey } = $api.queryOptions('get', '/api/playgrounds/{playground_id}', init)
  const settled = {
    onSuccess: (now: Playground) => void client.setQueryData(queryKey, now),
    onError: (error: unknown) =>
      notifications.show({ id: ground.id, color: 'red', title: 'Not done', message: messageOf(error) }),
  }
  const change = $api.useMutation('post', '/api/playgrounds/{playground_id}/changes', settled)
  const configure = $api.useMutation('put', '/api/playgrounds/{playground_id}/settings', settled)
  return {
    change: (body) => change.mutate({ ...init, body }),
    configure: (some) => configure.mutate({ ...init, body: { ...ground.settings, ...some } }),
  }
}
