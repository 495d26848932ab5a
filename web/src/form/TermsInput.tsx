/** A list of objects of several kinds, such as a reward's terms: a row for each, with its own few settings. */
import {
  ActionIcon,
  Button,
  Group,
  Input,
  Menu,
  NumberInput,
  Select,
  Switch,
  Text,
  TextInput,
} from '@mantine/core'
import { IconTrash } from '../components/icons'
import { fieldId } from './FieldInput'
import classes from './form.module.css'
import type { Field } from './layout'
import { problemOf } from './problems'
import { branches, defaults, type Json, resolve, type Schema, withoutNull } from './schema'
import type { Form } from './useForm'
import { pathKey, sameValue, valueAt } from './values'

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
  const presets = Object.entries(field.presets)
  const preset = presets.find(([, one]) => sameValue(one, terms as Json))?.[0]
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
      <Group gap="md" align="end" justify="space-between">
        {presets.length > 0 && (
          <Select
            label={field.trail.at(-1) ?? field.label}
            description={field.schema.description}
            data={[
              ...presets.map(([title]) => title),
              ...(preset ? [] : [{ value: '', label: 'Terms of your own' }]),
            ]}
            value={preset ?? ''}
            allowDeselect={false}
            inputWrapperOrder={['label', 'input', 'description']}
            onChange={(title) => {
              const chosen = presets.find(([one]) => one === title)
              if (chosen) form.set(field.path, chosen[1])
            }}
          />
        )}
      </Group>
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
                  <Part
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

interface PartProps {
  schema: Schema
  value: Json
  error: string | undefined
  onChange: (value: Json) => void
}

/** One setting of a term. */
function Part({ schema, value, error, onChange }: PartProps) {
  const common = {
    label: schema.title,
    description: schema.description,
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
      <Switch
        label={schema.title}
        description={schema.description}
        error={error}
        size="xs"
        className={classes.part}
        checked={value === true}
        onChange={(event) => onChange(event.currentTarget.checked)}
      />
    )
  if (schema.type === 'number')
    return (
      <NumberInput
        {...common}
        className={classes.part}
        value={typeof value === 'number' || typeof value === 'string' ? value : ''}
        onChange={(next) => onChange(next === '' ? null : next)}
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
