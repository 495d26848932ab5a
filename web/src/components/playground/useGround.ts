/** Changes to a playground: settings are shown at once, the rest as the server answers; a refusal is said. */
import { notifications } from '@mantine/notifications'
import { useQueryClient } from '@tanstack/react-query'
import { useEffect, useState } from 'react'
import { $api } from '../../api/client'
import { messageOf } from '../../api/errors'
import type { Playground, PlaygroundChange } from '../../api/types'

type Settings = Playground['settings']

export interface GroundActions {
  /** As they were last asked for; once all of that is answered, as the service says. */
  settings: Settings
  change: (change: PlaygroundChange) => void
  configure: (some: Partial<Settings>) => void
}

export function useGround(ground: Playground): GroundActions {
  const client = useQueryClient()
  const init = { params: { path: { playground_id: ground.id } } }
  const { queryKey } = $api.queryOptions('get', '/api/playgrounds/{playground_id}', init)
  const show = (now: Playground) => {
    // A look that is under way may have been answered before the change was made.
    void client.cancelQueries({ queryKey })
    client.setQueryData(queryKey, now)
  }
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
  // What was asked for stands before what the service says, since looks at it go on meanwhile: until they say the same.
  const [asked, setAsked] = useState<{ settings: Settings; answered: boolean } | null>(null)
  const settings = asked?.settings ?? ground.settings
  // biome-ignore lint/correctness/useExhaustiveDependencies: the answer is shown as soon as the service's word changes
  useEffect(() => setAsked((before) => (before?.answered ? null : before)), [ground])
  return {
    settings,
    change: (body) => change.mutate({ ...init, body }, { onSuccess: show }),
    configure: (some) => {
      const wanted = { ...settings, ...some }
      setAsked({ settings: wanted, answered: false })
      configure.mutate(
        { ...init, body: wanted },
        {
          // Of several presses only the last one's answer is heard: the others are older than what is shown.
          onSuccess: (now) => {
            setAsked({ settings: now.settings, answered: true })
            show(now)
          },
          onError: () => setAsked(null),
        },
      )
    },
  }
}
