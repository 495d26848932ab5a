/** Changes to a playground: settings are shown at once, the rest as the server answers; a refusal is said. */
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
  const show = (now: Playground) => void client.setQueryData(queryKey, now)
  const options = {
    // One after another, as they were made.
    scope: { id: `playground ${ground.id}` },
    onError: (error: unknown) => {
      notifications.show({ id: ground.id, color: 'red', title: 'Not done', message: messageOf(error) })
      void client.invalidateQueries({ queryKey })
    },
  }
  const change = $api.useMutation('post', '/api/playgrounds/{playground_id}/changes', options)
  const configure = $api.useMutation('put', '/api/playgrounds/{playground_id}/settings', options)
  return {
    change: (body) => change.mutate({ ...init, body }, { onSuccess: show }),
    configure: (some) => {
      // Shown at once: the next press of an arrow key goes on from here, whenever the answer comes.
      const now = client.getQueryData<Playground>(queryKey) ?? ground
      const settings = { ...now.settings, ...some }
      void client.cancelQueries({ queryKey })
      show({ ...now, settings })
      // Answers to all but the last press are older than what is shown.
      configure.mutate({ ...init, body: settings }, { onSuccess: show })
    },
  }
}
