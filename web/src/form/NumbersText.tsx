/** A list of numbers as it is typed: "64, 64". */
import { TextInput, type TextInputProps } from '@mantine/core'
import { useState } from 'react'
import type { Json } from './schema'
import { sameValue } from './values'

/** "64, 64" -> [64, 64]. What is no number is kept as it was typed: the server says what is wrong with it. */
export function parseNumbers(text: string): Json[] {
  return text
    .split(/[\s,;x×]+/)
    .filter(Boolean)
    .map((part) => (Number.isFinite(Number(part)) ? Number(part) : part))
}

interface NumbersTextProps extends Omit<TextInputProps, 'value' | 'onChange'> {
  value: Json
  onChange: (value: Json[]) => void
}

export function NumbersText({ value, onChange, ...input }: NumbersTextProps) {
  const written = Array.isArray(value) ? value.join(', ') : ''
  const [text, setText] = useState(written)
  // Somebody else (a preset) has set the value: show that, and not what was typed before.
  const shown = sameValue(parseNumbers(text), value) ? text : written
  return (
    <TextInput
      {...input}
      value={shown}
      onChange={(event) => {
        setText(event.currentTarget.value)
        onChange(parseNumbers(event.currentTarget.value))
      }}
    />
  )
}
