/** A list of objects of several kinds, such as a reward's terms: a row for each, with its own few settings. */
import { ActionIcon, Button, Input, Menu, Text } from '@mantine/core'
import { IconTrash } from '../components/icons'
import { fieldId } from './FieldInput'
import classes from './form.module.css'
import type { Field } from './layout'
import { PresetSelect } from './PresetSelect'
import { problemOf } from './problems'
import { Setting } from './Setting'
import { branches, defaults, type Json, resolve, type Schema, withoutNull } from './schema'
import type { Form } from './useForm'
import { pathKey, valueAt } from './values'

interface TermsInputProps {
  field: Field & { kind: 'terms' }
  form: Form
  root: Schema
}

type Term = { [key: string]: Json }

export function TermsInput({ field, form, root }: TermsInputProps) {
  const value = valueAt(form.values, field.path)
  const terms = (Array.isArray(value) ? value : []) as Term[]
  const kinds = branches(field.item, root)
  const tag = field.item.discriminator?.propertyName ?? 'name'
  const set = (next: Term[]) => form.set(field.path, next)
  const left = kinds.filter(
    ({ tag: kind }) => kind === 'formula' || !terms.some((term) => term[tag] === kind),
  )
  const full = terms.length >= (field.schema.maxItems ?? Number.POSITIVE_INFINITY)

  function add(kind: string) {
    const branch = kinds.find((one) => one.tag === kind)
    if (!branch) return
    const term = defaults(branch.schema, root) as Term
    set([...terms, 'label' in term ? { ...term, label: freeLabel(String(term.label), terms) } : term])
  }

  return (
    <section id={fieldId(field.key)} className={classes.terms} aria-label={field.label} tabIndex={-1}>
      <PresetSelect field={field} form={form} own="Terms of your own" />
      <Input.Error>{form.problems[field.key]}</Input.Error>
      <ul className={classes.rows}>
        {terms.map((term, index) => {
          const kind = kinds.find((one) => one.tag === term[tag])
          const key = pathKey([...field.path, index])
          return (
            // biome-ignore lint/suspicious/noArrayIndexKey: a term has no other identity than its place
            <li key={index} className={classes.row} aria-label={kind?.label}>
              <div className={classes.what}>
                <Text size="sm" fw={600}>
                  {kind?.label ?? String(term[tag])}
                </Text>
                <Text size="xs" c="dimmed">
                  {kind?.schema.description}
                </Text>
              </div>
              {Object.entries(kind?.schema.properties ?? {})
                .filter(([name]) => name !== tag)
                .map(([name, one]) => (
                  <Setting
                    key={name}
                    schema={withoutNull(resolve(one, root)).schema}
                    value={term[name] ?? null}
                    error={problemOf(form.problems, `${key}.${name}`)}
                    onChange={(next) => form.set([...field.path, index, name], next)}
                  />
                ))}
              <ActionIcon
                variant="subtle"
                color="gray"
                aria-label={`Remove ${kind?.label ?? 'this term'}`}
                disabled={terms.length <= (field.schema.minItems ?? 0)}
                onClick={() => set(terms.filter((_, other) => other !== index))}
              >
                <IconTrash size={16} stroke={1.6} />
              </ActionIcon>
            </li>
          )
        })}
      </ul>
      {!full && (
        <Menu position="bottom-start" withinPortal>
          <Menu.Target>
            <Button variant="default" size="xs">
              Add a term
            </Button>
          </Menu.Target>
          <Menu.Dropdown mah={360} style={{ overflowY: 'auto' }}>
            {left.map(({ tag: kind, label, schema }) => (
              <Menu.Item key={kind} onClick={() => add(kind)}>
                {label}
                <Text size="xs" c="dimmed" maw={360}>
                  {schema.description}
                </Text>
              </Menu.Item>
            ))}
          </Menu.Dropdown>
        </Menu>
      )}
    </section>
  )
}

/** "mine", or "mine_2" where that is taken. */
function freeLabel(label: string, terms: readonly Term[]): string {
  const taken = new Set(terms.map((term) => term.label))
  let free = label
  for (let number = 2; taken.has(free); number += 1) free = `${label}_${number}`
  return free
}
