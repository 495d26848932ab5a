/** Asks whether one of a list is to go; the question itself is `DeleteDialog`. */
import { ActionIcon } from '@mantine/core'
import { Hint } from './Hint'
import { IconTrash } from './icons'

interface DeleteButtonProps {
  /** What would go, for those who hear of a button and do not see its row. */
  name: string
  onClick: () => void
}

export function DeleteButton({ name, onClick }: DeleteButtonProps) {
  return (
    <Hint label={`Delete ${name}`}>
      <ActionIcon variant="subtle" color="gray" aria-label={`Delete ${name}`} onClick={onClick}>
        <IconTrash size={16} stroke={1.6} />
      </ActionIcon>
    </Hint>
  )
}
