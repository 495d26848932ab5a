/** An episode to take away, in the form that one chooses; a worker makes it, and the button says how far it is. */
import { Button, Menu, Text } from '@mantine/core'
import { notifications } from '@mantine/notifications'
import { useState } from 'react'
import { $now } from '../../api/client'
import { errorOf, refusalOf } from '../../api/errors'
import { at } from '../../lib/base'
import { percent } from '../../lib/format'
import { IconDownload } from '../icons'

const ASK_MS = 700

const FORMS = {
  scene: { label: 'Page that plays in 3D', said: 'One file, for any browser, without Mapless' },
  mp4: { label: 'MP4', said: 'A film from above' },
  gif: { label: 'GIF', said: 'The same, smaller, for chats and slides' },
  mcap: { label: 'MCAP', said: 'Messages of ROS 2, for Foxglove and ROS' },
} as const
type Form = keyof typeof FORMS

interface DownloadsProps {
  subjects: string
  episode: number
  /** Of the player, with its theme. */
  page: string
  theme: 'light' | 'dark'
}

export function Downloads({ subjects, episode, page, theme }: DownloadsProps) {
  const [making, setMaking] = useState<Form>()
  const progress = $now.useQuery(
    'get',
    '/api/replays/{subjects}/{episode}/progress',
    {
      params: { path: { subjects, episode }, query: { form: making ?? 'mp4', theme: drawn(making, theme) } },
    },
    { enabled: making !== undefined, refetchInterval: ASK_MS, retry: false },
  )
  const take = async (form: Form) => {
    const films = `/api/replays/${subjects}/${episode}`
    const path = at(
      form === 'scene'
        ? `${page}?download`
        : form === 'mcap'
          ? `${films}/mcap`
          : `${films}/${form}?theme=${theme}`,
    )
    setMaking(form)
    try {
      const made = await fetch(new Request(new URL(path, location.href)))
      if (!made.ok) throw await errorOf(made)
      // It is kept now: the browser fetches it as it fetches any file.
      void made.body?.cancel()
      const link = document.createElement('a')
      link.href = path
      link.download = ''
      link.click()
    } catch (error) {
      notifications.show({
        color: 'red',
        title: `Could not make the ${FORMS[form].label}`,
        message: refusalOf(error),
      })
    } finally {
      setMaking(undefined)
    }
  }
  return (
    <Menu width={290} position="top-end">
      <Menu.Target>
        <Button
          variant="default"
          size="xs"
          leftSection={<IconDownload size={14} />}
          disabled={making !== undefined}
        >
          {making ? `${FORMS[making].label}: ${percent(progress.data?.share ?? 0)}` : 'Download'}
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        {Object.entries(FORMS).map(([form, { label, said }]) => (
          <Menu.Item key={form} onClick={() => void take(form as Form)}>
            {label}
            <Text span display="block" size="xs" c="dimmed">
              {said}
            </Text>
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  )
}

/** Messages have no theme: they are the same in both. */
function drawn(form: Form | undefined, theme: 'light' | 'dark'): 'light' | 'dark' {
  return form === 'mcap' ? 'light' : theme
}
