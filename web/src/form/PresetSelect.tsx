/** Whole lists to begin with, by title: a reward's three of the paper, an observation's two. */
import { Select } from '@mantine/core'
import type { Field } from './layout'
import type { Form } from './useForm'
import { sameValue, valueAt } from './values'

interface PresetSelectProps {
  field: Field & { kind: 'terms' }
  form: Form
  /** What a list is called that is none of them. */
  own: string
}

export function PresetSelect({ field, form, own }: PresetSelectProps) {
  const presets = Object.entries(field.presets)
  if (presets.length === 0) return null
  const value = valueAt(form.values, field.path)
  const preset = presets.find(([, one]) => sameValue(one, value ?? null))?.[0]
  return (
    <Select
      label={field.trail.at(-1) ?? field.label}
      description={field.schema.description}
      data={[...presets.map(([title]) => title), ...(preset ? [] : [{ value: '', label: own }])]}
      value={preset ?? ''}
      allowDeselect={false}
      maw={320}
      inputWrapperOrder={['label', 'input', 'description']}
      onChange={(title) => {
        const chosen = presets.find(([one]) => one === title)
        if (chosen) form.set(field.path, chosen[1])
      }}
    />
  )
}
