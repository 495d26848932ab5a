/** What a row of the queue is dragged by, or moved with Alt and the arrow keys. */
import { ActionIcon } from '@mantine/core'
import { Hint } from '../components/Hint'
import { IconGripVertical } from '../components/icons'
import type { useDrag } from './drag'
import classes from './queue.module.css'

interface HandleProps {
  /** Of the row's run. */
  name: string
  drag: ReturnType<ReturnType<typeof useDrag>['handleOf']>
}

export function Handle({ name, drag }: HandleProps) {
  return (
    <Hint label="Drag, or Alt with the arrow keys" delay={600}>
      <ActionIcon
        variant="subtle"
        color="gray"
        size="sm"
        className={classes.handle}
        aria-label={`${name}: move in the queue, with Alt and the arrow keys`}
        aria-keyshortcuts="Alt+ArrowUp Alt+ArrowDown"
        {...drag}
      >
        <IconGripVertical size={16} />
      </ActionIcon>
    </Hint>
  )
}
