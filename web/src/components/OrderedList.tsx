/** What was chosen, in its order: each moved up or down, or removed, by buttons that a keyboard reaches. */
import { ActionIcon } from '@mantine/core'
import type { ReactNode } from 'react'
import { Hint } from './Hint'
import { IconArrowDown, IconArrowUp, IconX } from './icons'
import classes from './OrderedList.module.css'

interface OrderedListProps {
  /** What the list is of. */
  label: string
  items: readonly string[]
  titleOf: (item: string) => string
  /** So many stay. */
  least?: number
  /** Buttons of its own before the others. */
  extra?: (item: string, place: number) => ReactNode
  onMove: (items: string[]) => void
  onRemove: (place: number) => void
}

export function OrderedList({ label, items, titleOf, least = 0, extra, onMove, onRemove }: OrderedListProps) {
  const move = (place: number, by: number) => {
    const next = [...items]
    const [item] = next.splice(place, 1)
    if (item !== undefined) next.splice(place + by, 0, item)
    onMove(next)
  }
  return (
    <ol className={classes.list} aria-label={label}>
      {items.map((item, place) => (
        <li key={item}>
          <span title={item}>{titleOf(item)}</span>
          {extra?.(item, place)}
          <SmallButton
            label={`Move ${titleOf(item)} up`}
            disabled={place === 0}
            onClick={() => move(place, -1)}
          >
            <IconArrowUp size={14} />
          </SmallButton>
          <SmallButton
            label={`Move ${titleOf(item)} down`}
            disabled={place === items.length - 1}
            onClick={() => move(place, 1)}
          >
            <IconArrowDown size={14} />
          </SmallButton>
          <SmallButton
            label={`Remove ${titleOf(item)}`}
            disabled={items.length <= least}
            onClick={() => onRemove(place)}
          >
            <IconX size={14} />
          </SmallButton>
        </li>
      ))}
    </ol>
  )
}

interface SmallButtonProps {
  label: string
  pressed?: boolean
  disabled?: boolean
  onClick: () => void
  children: ReactNode
}

export function SmallButton({ label, pressed, disabled = false, onClick, children }: SmallButtonProps) {
  return (
    <Hint label={label}>
      <ActionIcon
        variant={pressed ? 'light' : 'subtle'}
        {...(pressed ? {} : { color: 'gray' })}
        size="sm"
        aria-label={label}
        aria-pressed={pressed}
        disabled={disabled}
        onClick={onClick}
      >
        {children}
      </ActionIcon>
    </Hint>
  )
}
