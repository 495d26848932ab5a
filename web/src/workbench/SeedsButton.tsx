/** Trains an experiment with more seeds. */
import { Button, Group, Modal, NumberInput, Stack, Text } from '@mantine/core'
import { useDisclosure } from '@mantine/hooks'
import { notifications } from '@mantine/notifications'
import { useQueryClient } from '@tanstack/react-query'
import { useState } from 'react'
import { $api } from '../api/client'
import { messageOf } from '../api/errors'
import type { Experiment } from '../api/types'
import { IconPlus } from '../components/icons'
import { plural } from '../lib/format'

const MOST = 50

export function SeedsButton({ experiment }: { experiment: Experiment }) {
  const client = useQueryClient()
  const [asking, dialog] = useDisclosure()
  const [count, setCount] = useState(4)
  const next = Math.max(-1, ...experiment.runs.map(({ seed }) => seed)) + 1
  const seeds = Array.from({ length: count }, (_, index) => next + index)
  const add = $api.useMutation('post', '/api/experiments/{experiment_id}/seeds', {
    onSuccess: dialog.close,
    onError: (error) =>
      notifications.show({ color: 'red', title: 'Could not add seeds', message: messageOf(error) }),
    onSettled: () => void client.invalidateQueries(),
  })
  return (
    <>
      <Button variant="default" leftSection={<IconPlus size={16} />} onClick={dialog.open}>
        Seeds
      </Button>
      <Modal opened={asking} onClose={dialog.close} title="Train more seeds">
        <Stack>
          <NumberInput
            label="Seeds to add"
            min={1}
            max={MOST}
            value={count}
            data-autofocus
            onChange={(value) => setCount(Math.min(MOST, Math.max(1, Number(value) || 1)))}
          />
          <Text size="sm" c="dimmed">
            {count === 1 ? `Seed ${next}` : `Seeds ${next} to ${next + count - 1}`}, beside the{' '}
            {plural(experiment.runs.length, 'seed')} that there are.
          </Text>
          <Group justify="flex-end">
            <Button variant="default" onClick={dialog.close}>
              Cancel
            </Button>
            <Button
              loading={add.isPending}
              onClick={() =>
                add.mutate({ params: { path: { experiment_id: experiment.id } }, body: { seeds } })
              }
            >
              Train
            </Button>
          </Group>
        </Stack>
      </Modal>
    </>
  )
}
