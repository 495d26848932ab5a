/** How many seeds, and for those who care, which. */
import { Anchor, NumberInput, Stack, Text, TextInput } from '@mantine/core'
import { useState } from 'react'
import { fieldId } from './FieldInput'
import type { Field } from './layout'
import { parseNumbers } from './NumbersText'
import { problemOf } from './problems'
import type { Json } from './schema'
import type { Form } from './useForm'
import { sameValue, valueAt } from './values'

/** With fewer seeds than this a difference between two configurations may be luck. */
const SEEDS_FOR_COMPARISON = 5

/** The seeds 0, 1, 2, ... that a mere number of seeds stands for. */
const firstSeeds = (n: number): number[] => Array.from({ length: n }, (_, seed) => seed)

const ORDER: ('label' | 'input' | 'error' | 'description')[] = ['label', 'input', 'error', 'description']

export function SeedsInput({ field, form }: { field: Field; form: Form }) {
  const value = valueAt(form.values, field.path) ?? []
  const seeds: Json[] = Array.isArray(value) ? value : []
  const plain = sameValue(seeds, firstSeeds(seeds.length))
  const [explicit, setExplicit] = useState(!plain)
  const [text, setText] = useState(seeds.join(', '))
  const error = problemOf(form.problems, field.key)
  const id = fieldId(field.key)
  const most = field.schema.maxItems ?? 50
  const toggle = (
    <Anchor
      component="button"
      type="button"
      inherit
      onClick={() => {
        if (explicit) form.set(field.path, firstSeeds(Math.max(1, seeds.length)))
        else setText(seeds.join(', '))
        setExplicit(!explicit)
      }}
    >
      {explicit ? 'Give a number instead' : 'Choose them'}
    </Anchor>
  )
  return (
    <Stack gap={4}>
      {explicit ? (
        <TextInput
          id={id}
          label="Seeds"
          inputWrapperOrder={ORDER}
          description={<>One run each, separated by commas. {toggle}</>}
          error={error}
          value={text}
          onChange={(event) => {
            setText(event.currentTarget.value)
            form.set(field.path, parseNumbers(event.currentTarget.value))
          }}
        />
      ) : (
        <NumberInput
          id={id}
          label="Number of seeds"
          inputWrapperOrder={ORDER}
          description={<>One run each. {toggle}</>}
          error={error}
          min={1}
          max={most}
          clampBehavior="strict"
          allowDecimal={false}
          allowNegative={false}
          value={seeds.length || ''}
          onChange={(next) => form.set(field.path, firstSeeds(typeof next === 'number' ? next : 0))}
        />
      )}
      {seeds.length < SEEDS_FOR_COMPARISON && (
        <Text size="xs" c="dimmed">
          {seeds.length === 1 ? 'One seed is' : 'So few are'} fine for a policy to use; to say that one
          configuration beats another takes {SEEDS_FOR_COMPARISON} or more.
        </Text>
      )}
    </Stack>
  )
}
