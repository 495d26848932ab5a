/** What people have put on a training: tags and notes. */
import { Button, Group, Stack, Text, Textarea } from '@mantine/core'
import { notifications } from '@mantine/notifications'
import { useQueryClient } from '@tanstack/react-query'
import { useState } from 'react'
import { $api } from '../api/client'
import { messageOf } from '../api/errors'
import { Panel } from '../components/ui'
import { lazily } from '../lib/lazily'
import { Tags } from './cells'

const Markdown = lazily(async () => (await import('./Markdown')).Markdown)
const MAX_CHARACTERS = 20_000

export function NotesPanel({ experimentId }: { experimentId: string }) {
  const client = useQueryClient()
  const path = { path: { experiment_id: experimentId } }
  const { data } = $api.useQuery('get', '/api/experiments/{experiment_id}/marks', { params: path })
  const [draft, setDraft] = useState<string | null>(null)
  const write = $api.useMutation('put', '/api/experiments/{experiment_id}/notes', {
    onSuccess: () => setDraft(null),
    onError: (error) =>
      notifications.show({ color: 'red', title: 'Could not save the notes', message: messageOf(error) }),
    onSettled: () => void client.invalidateQueries(),
  })
  if (!data) return null
  return (
    <Panel
      title="Notes"
      actions={
        draft === null && (
          <Group gap="xs">
            <Tags tags={data.tags} />
            <Button size="compact-sm" variant="default" onClick={() => setDraft(data.notes)}>
              {data.notes ? 'Edit' : 'Write'}
            </Button>
          </Group>
        )
      }
    >
      {draft !== null ? (
        <Stack gap="xs">
          <Textarea
            label="Markdown"
            rows={8}
            maxLength={MAX_CHARACTERS}
            data-autofocus
            value={draft}
            onChange={({ currentTarget }) => setDraft(currentTarget.value)}
          />
          <Group gap="xs" justify="flex-end">
            <Button variant="default" onClick={() => setDraft(null)}>
              Cancel
            </Button>
            <Button
              loading={write.isPending}
              onClick={() => write.mutate({ params: path, body: { notes: draft } })}
            >
              Save
            </Button>
          </Group>
        </Stack>
      ) : data.notes ? (
        <Markdown text={data.notes} />
      ) : (
        <Text size="sm" c="dimmed">
          Nothing yet: why it was launched, what came of it.
        </Text>
      )}
    </Panel>
  )
}
