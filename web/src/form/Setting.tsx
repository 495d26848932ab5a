/** One setting of an object in a list, such as a reward's term or an observation's part, as a small control. */
import { NumberInput, Select, TextInput } from '@mantine/core'
import { words } from '../lib/format'
import classes from './form.module.css'
import { SwitchInput } from './SwitchInput'
import type { Json, Schema } from './schema'

interface SettingProps {
  id?: string | undefined
  /** Beside its description. */
  more?: React.ReactNode
  schema: Schema
  value: Json
  error: string | undefined
  onChange: (value: Json) => void
}

export function Setting({ id, schema, value, error, more, onChange }: SettingProps) {
  const description = more ? (
    <>
      {schema.description}
      {more}
    </>
  ) : (
    schema.description
  )
  const common = {
    id,
    label: schema.title,
    description,
    error,
    size: 'xs' as const,
    inputWrapperOrder: ['label', 'input', 'error', 'description'] as (
      | 'label'
      | 'input'
      | 'error'
      | 'description'
    )[],
  }
  if (schema.type === 'boolean')
    return (
      <SwitchInput
        id={id}
        label={schema.title}
        description={description}
        error={error}
        size="xs"
        className={classes.part}
        checked={value === true}
        onChange={onChange}
      />
    )
  if (schema.enum)
    return (
      <Select
        {...common}
        className={classes.part}
        data={schema.enum.map((one) => ({ value: String(one), label: words(String(one)) }))}
        value={String(value)}
        allowDeselect={false}
        onChange={(next) => next !== null && onChange(next)}
      />
    )
  if (schema.type === 'number' || schema.type === 'integer')
    return (
      <NumberInput
        {...common}
        className={classes.part}
        value={typeof value === 'number' || typeof value === 'string' ? value : ''}
        onChange={(next) => onChange(next === '' ? null : next)}
        allowDecimal={schema.type === 'number'}
        clampBehavior="none"
        decimalScale={10}
      />
    )
  return (
    <TextInput
      {...common}
      className={schema.maxLength && schema.maxLength > 100 ? classes.formula : classes.part}
      value={typeof value === 'string' ? value : ''}
      maxLength={schema.maxLength}
      spellCheck={false}
      onChange={(event) => onChange(event.currentTarget.value)}
    />
  )
}
