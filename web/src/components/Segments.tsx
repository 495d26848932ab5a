/**
 * A choice among a few, all in sight. Radio buttons of the browser's, drawn by style sheet alone: Mantine's SegmentedControl
 * measures itself while the page is drawn, and holds up all that is drawn after it.
 */
import { type ComponentPropsWithoutRef, useId } from 'react'
import classes from './Segments.module.css'

interface SegmentsProps<Value extends string>
  extends Pick<ComponentPropsWithoutRef<'div'>, 'aria-label' | 'aria-labelledby' | 'className' | 'id'> {
  value: Value
  /** The choices, from left to right. */
  data: readonly { value: Value; label: string }[]
  onChange: (value: Value) => void
  size?: 'xs' | 'sm'
  /** Takes all the width that there is. */
  wide?: boolean
  disabled?: boolean
}

export function Segments<Value extends string>({
  value,
  data,
  onChange,
  size = 'sm',
  wide = false,
  disabled = false,
  className = '',
  ...others
}: SegmentsProps<Value>) {
  const name = useId()
  return (
    <div
      role="radiogroup"
      className={`${classes.segments} ${className}`}
      data-size={size}
      data-wide={wide}
      {...others}
    >
      {data.map((one) => (
        <label key={one.value} className={classes.segment}>
          <input
            type="radio"
            name={name}
            value={one.value}
            checked={one.value === value}
            disabled={disabled}
            onChange={() => onChange(one.value)}
          />
          <span>{one.label}</span>
        </label>
      ))}
    </div>
  )
}
