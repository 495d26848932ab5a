/** A switch with its description below: what is pressed in there is no part of the switch, or of its name. */
import { Input, Switch } from '@mantine/core'
import { type ReactNode, useId } from 'react'
import classes from './form.module.css'

interface SwitchInputProps {
  id?: string | undefined
  label: string | undefined
  description: ReactNode
  error: string | undefined
  checked: boolean
  size?: 'xs' | 'sm'
  className?: string | undefined
  onChange: (checked: boolean) => void
}

export function SwitchInput({
  id,
  label,
  description,
  error,
  checked,
  size = 'sm',
  className,
  onChange,
}: SwitchInputProps) {
  const own = useId()
  const name = id ?? own
  const below = `${name}-description`
  return (
    <div className={className}>
      <Switch
        id={name}
        label={label}
        error={error}
        size={size}
        checked={checked}
        aria-describedby={below}
        onChange={(event) => onChange(event.currentTarget.checked)}
      />
      <Input.Description id={below} size={size} className={classes.below}>
        {description}
      </Input.Description>
    </div>
  )
}
