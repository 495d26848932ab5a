/** The question before something is removed for good. */
import { Button, Group, Modal, Stack, Text } from '@mantine/core'
import type { ReactNode } from 'react'

interface DeleteDialogProps {
  opened: boolean
  /** What goes, as the title asks for it. */
  what: string
  /** What goes with it. */
  children: ReactNode
  busy: boolean
  onClose: () => void
  onDelete: () => void
}

export function DeleteDialog({ opened, what, children, busy, onClose, onDelete }: DeleteDialogProps) {
  return (
    <Modal opened={opened} onClose={onClose} title={`Delete ${what}?`}>
      <Stack>
        <Text size="sm">{children}</Text>
        <Group justify="flex-end">
          <Button variant="default" onClick={onClose} data-autofocus>
            Keep
          </Button>
          <Button color="red" loading={busy} onClick={onDelete}>
            Delete
          </Button>
        </Group>
      </Stack>
    </Modal>
  )
}
