/**
 * Words beside what the mouse points at or the keyboard focuses, for what stands in every row: Mantine's tooltip costs a page as much
 * as the row itself, so it is made when it is first asked for. A reader of the screen is not told: the name of what it belongs to says it.
 */
import { Tooltip, type TooltipProps } from '@mantine/core'
import { useTimeout, useWindowEvent } from '@mantine/hooks'
import { cloneElement, type FocusEvent, type PointerEvent, type ReactElement, useRef, useState } from 'react'

const DELAY_MS = 300

interface Asked {
  onPointerEnter?: (event: PointerEvent<HTMLElement>) => void
  onPointerLeave?: (event: PointerEvent<HTMLElement>) => void
  onFocus?: (event: FocusEvent<HTMLElement>) => void
  onBlur?: (event: FocusEvent<HTMLElement>) => void
}

interface HintProps extends Pick<TooltipProps, 'label' | 'multiline' | 'maw'> {
  delay?: number
  /** One element, without handlers of its own for the events of `Asked`. */
  children: ReactElement<Asked>
}

export function Hint({ delay = DELAY_MS, children, ...words }: HintProps) {
  const target = useRef<HTMLElement>(null)
  const [made, setMade] = useState(false)
  const [opened, setOpened] = useState(false)
  const open = () => {
    setMade(true)
    setOpened(true)
  }
  const soon = useTimeout(open, delay)
  const close = () => {
    soon.clear()
    setOpened(false)
  }
  return (
    <>
      {cloneElement(children, {
        onPointerEnter: ({ currentTarget, pointerType }) => {
          target.current = currentTarget
          if (pointerType !== 'touch') soon.start()
        },
        onPointerLeave: close,
        onFocus: ({ currentTarget }) => {
          target.current = currentTarget
          if (currentTarget.matches(':focus-visible')) open()
        },
        onBlur: close,
      })}
      {made && <Words {...words} target={target} opened={opened} onEscape={close} />}
    </>
  )
}

function Words({ onEscape, ...tooltip }: TooltipProps & { onEscape: () => void }) {
  useWindowEvent('keydown', ({ key }) => key === 'Escape' && onEscape())
  return <Tooltip {...tooltip} />
}
