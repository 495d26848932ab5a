/** The arena as it stands, for the gallery: to train on, to be measured in. */
import { Button, Group, Stack, Text, TextInput } from '@mantine/core'
import { useQueryClient } from '@tanstack/react-query'
import { useState } from 'react'
import { Link } from 'react-router'
import { $api } from '../../api/client'
import { messageOf } from '../../api/errors'
import type { Playground } from '../../api/types'
import { trainOn } from '../../lib/arenas'
import { evaluate, suiteInArena } from '../evaluations/choices'
import { Notice, Panel } from '../ui'

export function KeepArena({ ground }: { ground: Playground }) {
  const client = useQueryClient()
  const [name, setName] = useState('')
  const keep = $api.useMutation('post', '/api/playgrounds/{playground_id}/arena', {
    onSuccess: () => client.invalidateQueries({ queryKey: ['get', '/api/arenas'] }),
  })
  return (
    <Panel title="Keep this moment">
      <Stack
        component="form"
        gap="xs"
        onSubmit={(event) => {
          event.preventDefault()
          keep.mutate({ params: { path: { playground_id: ground.id } }, body: { name } })
        }}
      >
        <Text size="xs" c="dimmed">
          As an arena of the gallery: what stands here, the robot's place as its start, and its target.
        </Text>
        <Group gap="xs" wrap="nowrap" align="flex-end">
          <TextInput
            flex={1}
            size="xs"
            label="Name"
            maxLength={80}
            value={name}
            onChange={(event) => setName(event.currentTarget.value)}
          />
          <Button
            type="submit"
            size="xs"
            variant="default"
            disabled={name.trim() === ''}
            loading={keep.isPending}
          >
            Keep
          </Button>
        </Group>
        {keep.error && (
          <Notice title="Not kept" bad role="alert">
            {messageOf(keep.error)}
          </Notice>
        )}
        {keep.data && (
          <Group gap="xs">
            <Button component={Link} to={trainOn(keep.data.config)} size="xs">
              Train on it
            </Button>
            <Button
              component={Link}
              to={evaluate([], [suiteInArena(keep.data.config)])}
              size="xs"
              variant="default"
            >
              Evaluate on it
            </Button>
          </Group>
        )}
      </Stack>
    </Panel>
  )
}
