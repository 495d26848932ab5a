/** The arena as it stands, for the gallery: to train on, to be measured in. */
import { Autocomplete, Button, Group, Stack, Text, TextInput } from '@mantine/core'
import { useMutation, useQueryClient } from '@tanstack/react-query'
import { useState } from 'react'
import { Link } from 'react-router'
import { $api } from '../../api/client'
import { messageOf } from '../../api/errors'
import type { Playground } from '../../api/types'
import { trainOn } from '../../lib/arenas'
import { plural } from '../../lib/format'
import { evaluate, suiteInArena, suiteOfOnesOwn } from '../evaluations/choices'
import { useOwnSuite } from '../evaluations/useOwnSuite'
import { Notice, Panel } from '../ui'

export function KeepArena({ ground }: { ground: Playground }) {
  const client = useQueryClient()
  const [name, setName] = useState('')
  const [suite, setSuite] = useState('')
  const suites = useOwnSuite()
  const arena = $api.useMutation('post', '/api/playgrounds/{playground_id}/arena')
  const keep = useMutation({
    networkMode: 'always',
    mutationFn: async () => {
      const { config } = await arena.mutateAsync({
        params: { path: { playground_id: ground.id } },
        body: { name },
      })
      const wanted = suite.trim()
      return { config, suite: wanted === '' ? null : await suites.add(wanted, config.sha256) }
    },
    onSettled: () =>
      Promise.all(
        ['/api/arenas', '/api/suites'].map((path) => client.invalidateQueries({ queryKey: ['get', path] })),
      ),
  })
  return (
    <Panel title="Keep this moment">
      <Stack
        component="form"
        gap="xs"
        onSubmit={(event) => {
          event.preventDefault()
          keep.mutate()
        }}
      >
        <Text size="xs" c="dimmed">
          As an arena of the gallery: what stands here, the robot's place as its start, and its target; and,
          if you like, as a scenario of a suite of your own.
        </Text>
        <TextInput
          size="xs"
          label="Name"
          maxLength={80}
          value={name}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <Group gap="xs" wrap="nowrap" align="flex-end">
          <Autocomplete
            flex={1}
            size="xs"
            label="Suite of your own"
            placeholder="None; a new name begins one"
            maxLength={40}
            value={suite}
            onChange={setSuite}
            data={suites.names}
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
        {keep.data?.suite && (
          <Text size="xs" role="status">
            {keep.data.suite.name} has {plural(keep.data.suite.scenarios.length, 'scenario')} now.
          </Text>
        )}
        {keep.data && (
          <Group gap="xs">
            <Button component={Link} to={trainOn(keep.data.config)} size="xs">
              Train on it
            </Button>
            <Button
              component={Link}
              to={evaluate(
                [],
                [keep.data.suite ? suiteOfOnesOwn(keep.data.suite.id) : suiteInArena(keep.data.config)],
              )}
              size="xs"
              variant="default"
            >
              {keep.data.suite ? 'Evaluate on the suite' : 'Evaluate on it'}
            </Button>
          </Group>
        )}
      </Stack>
    </Panel>
  )
}
