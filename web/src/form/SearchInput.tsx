/** A field that is searched: the ends of its range, which of its options are tried, or which lists of numbers. */
import { ActionIcon, Anchor, Checkbox, Group, Input, NumberInput, Stack } from '@mantine/core'
import { IconTrash } from '../components/icons'
import { fieldId } from './FieldInput'
import type { Field } from './layout'
import { NumbersText } from './NumbersText'
import { optionsOf, type Searched } from './search'

interface SearchInputProps {
  field: Field
  /** What it is called here, where that is less than the field's label. */
  label?: string | undefined
  searched: Searched
  error: string | undefined
  size?: 'xs' | 'sm'
  className?: string | undefined
  onChange: (searched: Searched | null) => void
}

/** What makes a field a searched one. */
export function TryMany({ field, onClick }: { field: Field; onClick: () => void }) {
  const what = field.kind === 'number' ? 'Try a range' : 'Try several'
  return (
    <>
      {' '}
      <Anchor
        component="button"
        type="button"
        inherit
        aria-label={`${what}: ${field.label}`}
        onClick={onClick}
      >
        {what}
      </Anchor>
    </>
  )
}

export function SearchInput({
  field,
  label,
  searched,
  error,
  size = 'sm',
  className,
  onChange,
}: SearchInputProps) {
  const back = (
    <Anchor
      component="button"
      type="button"
      inherit
      aria-label={`One value of ${field.label}`}
      onClick={() => onChange(null)}
    >
      Back to one value
    </Anchor>
  )
  return (
    <Input.Wrapper
      label={label ?? field.label}
      labelElement="div"
      error={error}
      size={size}
      className={className}
      description={
        <>
          A study tries {searched.kind === 'range' ? 'values between' : 'these'}. {back}
        </>
      }
      inputWrapperOrder={['label', 'input', 'error', 'description']}
      role="group"
      aria-label={`${field.label}, searched`}
    >
      {searched.kind === 'range' ? (
        <Range field={field} searched={searched} size={size} onChange={onChange} />
      ) : field.kind === 'numbers' ? (
        <Lists field={field} searched={searched} onChange={onChange} />
      ) : (
        <Group gap="md" mih={34} id={fieldId(field.key)} tabIndex={-1}>
          {optionsOf(field).map(({ value, label }) => (
            <Checkbox
              key={String(value)}
              label={label}
              size={size}
              checked={searched.values.includes(value)}
              onChange={(event) => {
                const others = searched.values.filter((one) => one !== value)
                onChange({ kind: 'list', values: event.currentTarget.checked ? [...others, value] : others })
              }}
            />
          ))}
        </Group>
      )}
    </Input.Wrapper>
  )
}

function Range({
  field,
  searched,
  size,
  onChange,
}: {
  field: Field
  searched: Searched & { kind: 'range' }
  size: 'xs' | 'sm'
  onChange: (searched: Searched) => void
}) {
  const whole = field.kind === 'number' && field.integer
  const end = (which: 'low' | 'high', name: string) => (
    <NumberInput
      id={which === 'low' ? fieldId(field.key) : undefined}
      aria-label={`${field.label}, ${name}`}
      size={size}
      value={searched[which]}
      onChange={(next) => onChange({ ...searched, [which]: next })}
      allowDecimal={!whole}
      clampBehavior="none"
      decimalScale={10}
      hideControls
    />
  )
  return (
    <>
      <Group gap={8} wrap="nowrap" fz={size}>
        {end('low', 'from')}
        <span>to</span>
        {end('high', 'to')}
      </Group>
      <Checkbox
        size="xs"
        mt={8}
        label="Logarithmic scale"
        checked={searched.log}
        onChange={(event) => onChange({ ...searched, log: event.currentTarget.checked })}
      />
    </>
  )
}

/** Lists of numbers, one in a line. */
function Lists({
  field,
  searched,
  onChange,
}: {
  field: Field
  searched: Searched & { kind: 'list' }
  onChange: (searched: Searched) => void
}) {
  const { values } = searched
  const set = (next: typeof values) => onChange({ kind: 'list', values: next })
  return (
    <Stack gap={6} id={fieldId(field.key)} tabIndex={-1}>
      {values.map((value, index) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: a list has no other identity than its place
        <Group key={index} gap={6} wrap="nowrap">
          <NumbersText
            aria-label={`${field.label}, choice ${index + 1}`}
            style={{ flex: 1 }}
            value={Array.isArray(value) ? value : []}
            onChange={(next) => set(values.map((one, other) => (other === index ? next : one)))}
          />
          <ActionIcon
            variant="subtle"
            color="gray"
            aria-label={`Remove choice ${index + 1} of ${field.label}`}
            disabled={values.length <= 2}
            onClick={() => set(values.filter((_, other) => other !== index))}
          >
            <IconTrash size={16} stroke={1.6} />
          </ActionIcon>
        </Group>
      ))}
      <Anchor
        component="button"
        type="button"
        size="xs"
        style={{ alignSelf: 'flex-start' }}
        aria-label={`Another choice of ${field.label}`}
        onClick={() => set([...values, []])}
      >
        Add another
      </Anchor>
    </Stack>
  )
}
