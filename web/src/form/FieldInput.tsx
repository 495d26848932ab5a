/** One field of a form, as the control that fits its schema. */
import { Anchor, Input, NumberInput, Select, Text, TextInput } from '@mantine/core'
import { Segments } from '../components/Segments'
import { count, significant, words } from '../lib/format'
import classes from './form.module.css'
import { ImportedArenaInput } from './ImportedArenaInput'
import { type Field, initialOf } from './layout'
import { NumbersText } from './NumbersText'
import { problemOf } from './problems'
import { SearchInput, TryMany } from './SearchInput'
import { SwitchInput } from './SwitchInput'
import { type Json, range, type Schema } from './schema'
import { freshSearch, useSearched } from './search'
import { TermsInput } from './TermsInput'
import { TicksInput } from './TicksInput'
import type { Form } from './useForm'
import { sameValue, valueAt } from './values'

/** More choices than this go into a drop-down list. */
const SEGMENTS = 4

interface FieldInputProps {
  field: Field
  form: Form
  root: Schema
  /** The values of a fresh form, to say what a changed field was and to go back to it. */
  initial: Json
}

/** The element id of a field's control, where a summary of problems leads. */
export const fieldId = (key: string): string => `field-${key.replaceAll('.', '-')}`

export function FieldInput({ field, form, root, initial }: FieldInputProps) {
  const value = valueAt(form.values, field.path) ?? null
  const fresh = initialOf(field, form.values, initial)
  const error = problemOf(form.problems, field.key)
  const search = useSearched(field, form.values)
  if (search?.searched !== undefined)
    return <SearchInput field={field} searched={search.searched} error={error} onChange={search.set} />
  const common = {
    id: fieldId(field.key),
    label: field.label,
    description: (
      <>
        <Description field={field} value={value} form={form} initial={fresh} />
        {search && <TryMany field={field} onClick={() => search.set(freshSearch(field, value))} />}
      </>
    ),
    error,
    inputWrapperOrder: ['label', 'input', 'error', 'description'] as (
      | 'label'
      | 'input'
      | 'error'
      | 'description'
    )[],
  }
  const set = (next: Json) => form.set(field.path, next)

  switch (field.kind) {
    case 'union': {
      const tag = String(valueAt(form.values, [...field.path, field.tag]) ?? '')
      // Problems of the fields inside stand at those fields.
      const own = form.problems[field.key]
      return (
        <Choice
          {...common}
          error={own}
          options={field.options}
          value={tag}
          onChange={(next) => form.choose(field.path, field.schema, root, next)}
        />
      )
    }
    case 'choice':
      return <Choice {...common} options={field.options} value={String(value)} onChange={set} />
    case 'boolean':
      return (
        <SwitchInput
          id={common.id}
          label={field.label}
          description={common.description}
          error={error}
          checked={value === true}
          onChange={set}
          className={classes.switch}
        />
      )
    case 'number':
      return (
        <NumberInput
          {...common}
          value={typeof value === 'number' || typeof value === 'string' ? value : ''}
          onChange={(next) => set(next === '' ? null : next)}
          allowDecimal={!field.integer}
          // Out of range is the server's to refuse, with words; a silent correction would be worse.
          clampBehavior="none"
          step={field.integer ? 1 : stepOf(value)}
          thousandSeparator={field.integer ? ' ' : false}
          decimalScale={10}
        />
      )
    case 'numbers':
      return <NumbersInput {...common} value={value} placeholder={listed(fresh)} onChange={set} />
    case 'terms':
      return field.schema['x-ticks'] ? (
        <TicksInput field={field} form={form} root={root} />
      ) : (
        <TermsInput field={field} form={form} root={root} />
      )
    case 'text':
      if (field.schema['x-imported-arena'])
        return (
          <ImportedArenaInput
            id={common.id}
            label={common.label}
            error={error}
            value={typeof value === 'string' ? value : ''}
            onChange={set}
          />
        )
      return (
        <TextInput
          {...common}
          value={typeof value === 'string' ? value : ''}
          maxLength={field.schema.maxLength}
          onChange={(event) => set(event.currentTarget.value)}
        />
      )
  }
}

/** The arrows of a number move its second digit: 0.001 by 0.0001. */
function stepOf(value: Json): number {
  return typeof value === 'number' && value > 0 ? 10 ** (Math.floor(Math.log10(value)) - 1) : 0.1
}

function Description({
  field,
  value,
  form,
  initial,
}: {
  field: Field
  value: Json
  form: Form
  initial: Json | undefined
}) {
  const number = (limit: number) =>
    field.kind === 'number' && field.integer ? count(limit) : significant(limit)
  const limits = field.kind === 'number' ? range(field.schema, number) : undefined
  const help = [field.schema.description, limits && `${limits.charAt(0).toUpperCase()}${limits.slice(1)}.`]
  const changed = field.kind !== 'union' && initial !== undefined && !sameValue(value, initial)
  const back =
    typeof initial === 'number'
      ? number(initial)
      : Array.isArray(initial)
        ? listed(initial)
        : words(String(initial))
  return (
    <>
      {help.filter(Boolean).join(' ')}
      {changed && field.advanced && (
        <Anchor component="button" type="button" inherit ml={6} onClick={() => form.set(field.path, initial)}>
          Back to {back}
        </Anchor>
      )}
    </>
  )
}

interface ChoiceProps {
  id: string
  label: string
  description: React.ReactNode
  error: string | undefined
  options: { value: string; label: string }[]
  value: string
  onChange: (value: string) => void
}

function Choice({ id, label, description, error, options, value, onChange }: ChoiceProps) {
  if (options.length > SEGMENTS) {
    return (
      <Select
        id={id}
        label={label}
        description={description}
        error={error}
        data={options}
        value={value}
        allowDeselect={false}
        inputWrapperOrder={['label', 'input', 'error', 'description']}
        onChange={(next) => next !== null && onChange(next)}
      />
    )
  }
  const only = options.length === 1 ? options[0] : undefined
  return (
    <Input.Wrapper
      label={label}
      labelElement="div"
      description={description}
      error={error}
      inputWrapperOrder={['label', 'input', 'error', 'description']}
    >
      {only ? (
        <Text id={id} size="sm" className={classes.only} tabIndex={-1}>
          {only.label}
        </Text>
      ) : (
        <Segments id={id} aria-label={label} wide data={options} value={value} onChange={onChange} />
      )}
    </Input.Wrapper>
  )
}

interface NumbersInputProps {
  id: string
  label: string
  description: React.ReactNode
  error: string | undefined
  value: Json
  placeholder: string
  onChange: (value: Json) => void
}

/** [64, 64] -> "64, 64", and "none" for an empty list. */
function listed(value: Json | undefined): string {
  return (Array.isArray(value) && value.join(', ')) || 'none'
}

function NumbersInput(props: NumbersInputProps) {
  return <NumbersText {...props} inputWrapperOrder={['label', 'input', 'error', 'description']} />
}
