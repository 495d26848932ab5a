/** A field that is searched: the ends of its range, or which of its options are tried. */
import { Anchor, Checkbox, Group, Input, NumberInput } from '@mantine/core'
import { fieldId } from './FieldInput'
import type { Field } from './layout'
import { optionsOf, type Searched } from './search'

interface SearchInputProps {
  field: Field
  searched: Searched
  error: string | undefined
  onChange: (searched: Searched | null) => void
}

export function SearchInput({ field, searched, error, onChange }: SearchInputProps) {
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
      label={field.label}
      labelElement="div"
      error={error}
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
        <Range field={field} searched={searched} onChange={onChange} />
      ) : (
        <Group gap="md" mih={34} id={fieldId(field.key)} tabIndex={-1}>
          {optionsOf(field).map(({ value, label }) => (
            <Checkbox
              key={String(value)}
              label={label}
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
  onChange,
}: {
  field: Field
  searched: Searched & { kind: 'range' }
  onChange: (searched: Searched) => void
}) {
  const whole = field.kind === 'number' && field.integer
  const end = (which: 'low' | 'high', name: string) => (
    <NumberInput
      id={which === 'low' ? fieldId(field.key) : undefined}
      aria-label={`${field.label}, ${name}`}
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
      <Group gap={8} wrap="nowrap">
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
