/**
 * A list of which each kind may be there once, such as an observation's parts: one tick leaves it out or takes it in. What can be
 * set of a part is told in a line, and shown when asked for.
 */
import { Anchor, Checkbox, Input, Text } from '@mantine/core'
import { useRef, useState } from 'react'
import { fieldId } from './FieldInput'
import classes from './form.module.css'
import type { Field } from './layout'
import { PresetSelect } from './PresetSelect'
import { problemOf } from './problems'
import { Setting } from './Setting'
import { branches, defaults, type Json, resolve, type Schema, withoutNull } from './schema'
import { settingText } from './settingText'
import type { Form } from './useForm'
import { pathKey, valueAt } from './values'

interface TicksInputProps {
  field: Field & { kind: 'terms' }
  form: Form
  root: Schema
}

type Part = { [key: string]: Json }

export function TicksInput({ field, form, root }: TicksInputProps) {
  const value = valueAt(form.values, field.path)
  const parts = (Array.isArray(value) ? value : []) as Part[]
  const kinds = branches(field.item, root)
  const tag = field.item.discriminator?.propertyName ?? 'name'
  // What was left out comes back as it was.
  const left = useRef(new Map<string, Part>())
  const [opened, setOpened] = useState<readonly string[]>([])

  function tick(kind: string, schema: Schema, ticked: boolean) {
    const gone = parts.find((part) => part[tag] === kind)
    if (gone) left.current.set(kind, gone)
    const others = parts.filter((part) => part[tag] !== kind)
    const back = left.current.get(kind) ?? (defaults(schema, root) as Part)
    const next = ticked ? [...others, back] : others
    const order = kinds.map((one) => one.tag)
    next.sort((a, b) => order.indexOf(String(a[tag])) - order.indexOf(String(b[tag])))
    form.set(field.path, next)
  }

  return (
    <section id={fieldId(field.key)} className={classes.terms} aria-label={field.label} tabIndex={-1}>
      <PresetSelect field={field} form={form} own="Parts of your own" />
      <Input.Error>{form.problems[field.key]}</Input.Error>
      <ul className={classes.rows}>
        {kinds.map(({ tag: kind, label, schema }) => {
          const index = parts.findIndex((part) => part[tag] === kind)
          const part = parts[index]
          const settings = Object.entries(schema.properties ?? {}).filter(([name]) => name !== tag)
          const place = pathKey([...field.path, index])
          // What was refused is never hidden.
          const isRefused = part !== undefined && problemOf(form.problems, place) !== undefined
          const isOpen = opened.includes(kind) || isRefused
          return (
            <li key={kind} className={classes.row} aria-label={label}>
              <Checkbox
                className={classes.what}
                label={label}
                description={schema.description}
                checked={part !== undefined}
                disabled={part !== undefined && parts.length <= (field.schema.minItems ?? 0)}
                onChange={(event) => tick(kind, schema, event.currentTarget.checked)}
              />
              {part && settings.length > 0 && (
                <Text size="xs" c="dimmed" className={classes.brief}>
                  {isOpen
                    ? ''
                    : settings
                        .map(([name, one]) => `${resolve(one, root).title}: ${settingText(part[name])}`)
                        .join(', ')}
                  <Anchor
                    component="button"
                    type="button"
                    inherit
                    ml={8}
                    aria-label={`${isOpen ? 'Done' : 'Change'}: settings of ${label}`}
                    aria-expanded={isOpen}
                    disabled={isRefused}
                    onClick={() =>
                      setOpened(isOpen ? opened.filter((one) => one !== kind) : [...opened, kind])
                    }
                  >
                    {isOpen ? 'Done' : 'Change'}
                  </Anchor>
                </Text>
              )}
              {part &&
                isOpen &&
                settings.map(([name, one]) => (
                  <Setting
                    key={name}
                    id={fieldId(`${place}.${name}`)}
                    schema={withoutNull(resolve(one, root)).schema}
                    value={part[name] ?? null}
                    error={problemOf(form.problems, `${place}.${name}`)}
                    onChange={(next) => form.set([...field.path, index, name], next)}
                  />
                ))}
            </li>
          )
        })}
      </ul>
    </section>
  )
}
