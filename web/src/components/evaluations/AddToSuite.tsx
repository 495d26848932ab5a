/** An arena of the gallery becomes a scenario of a suite of one's own. */
import { Autocomplete, Button, Group, Modal, Stack, Text } from '@mantine/core'
import { useMutation, useQueryClient } from '@tanstack/react-query'
import { useState } from 'react'
import { Link } from 'react-router'
import { messageOf } from '../../api/errors'
import { plural } from '../../lib/format'
import { Notice } from '../ui'
import { evaluate, suiteOfOnesOwn } from './choices'
import { useOwnSuite } from './useOwnSuite'

interface AddToSuiteProps {
  title: string
  sha256: string
  onClose: () => void
}

export function AddToSuite({ title, sha256, onClose }: AddToSuiteProps) {
  const client = useQueryClient()
  const suites = useOwnSuite()
  const [name, setName] = useState('')
  const add = useMutation({
    networkMode: 'always',
    mutationFn: () => suites.add(name.trim(), sha256),
    onSettled: () => client.invalidateQueries({ queryKey: ['get', '/api/suites'] }),
  })
  return (
    <Modal opened onClose={onClose} title={`Add ${title} to a suite`}>
      <Stack
        component="form"
        onSubmit={(event) => {
          event.preventDefault()
          add.mutate()
        }}
      >
        <Text size="sm">
          With its start and its target it is one scenario, the same for every policy that is measured on the
          suite.
        </Text>
        <Autocomplete
          label="Suite of your own"
          placeholder="A new name begins one"
          maxLength={40}
          value={name}
          onChange={setName}
          data={suites.names}
          data-autofocus
        />
        {add.error && (
          <Notice title="Not added" bad role="alert">
            {messageOf(add.error)}
          </Notice>
        )}
        {add.data && (
          <Text size="sm" role="status">
            {add.data.name} has {plural(add.data.scenarios.length, 'scenario')} now.
          </Text>
        )}
        <Group justify="flex-end">
          {add.data && (
            <Button component={Link} to={evaluate([], [suiteOfOnesOwn(add.data.id)])} variant="default">
              Evaluate on the suite
            </Button>
          )}
          <Button type="submit" disabled={name.trim() === ''} loading={add.isPending}>
            Add
          </Button>
        </Group>
      </Stack>
    </Modal>
  )
}
