/** A list of objects of several kinds, such as a reward's terms: a row for each, with its own few settings. */
import { ActionIcon, Button, Input, Menu, Text } from '@mantine/core'
import { useContext } from 'react'
import { IconTrash } from '../components/icons'
import { fieldId } from './FieldInput'
import classes from './form.module.css'
import { type Field, settingsInTerms } from './layout'
import { PresetSelect } from './PresetSelect'
import { problemOf } from './problems'
import { SearchInput, TryMany } from './SearchInput'
import { Setting } from './Setting'
import { branches, defaults, type Json, resolve, type Schema, withoutNull } from './schema'
import { freshSearch, SearchContext, searchKey, useSearched } from './search'
import type { Form } from './useForm'
import { pathKey, valueAt, withValue } from './values'

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
  const settings = settingsInTerms(field, root, form.values)
  const search = useContext(SearchContext)
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

  /** A formula is searched by its name: when that changes, the search stays with it. */
  function takeSearchAlong(index: number, label: Json) {
    const path = [...field.path, index]
    const from = searchKey([...path, 'weight'], form.values)
    const to = searchKey([...path, 'weight'], withValue(form.values, [...path, 'label'], label))
    const own = terms.filter((term) => term.label === terms[index]?.label).length === 1
    const searched = search?.searched[from]
    if (!search || !searched || !own || to in search.searched) return
    search.set(from, null)
    search.set(to, searched)
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
                  <TermSetting
                    key={name}
                    setting={settings.find((each) => each.key === `${key}.${name}`)}
                    schema={withoutNull(resolve(one, root)).schema}
                    value={term[name] ?? null}
                    form={form}
                    onChange={(next) => {
                      if (name === 'label') takeSearchAlong(index, next)
                      form.set([...field.path, index, name], next)
                    }}
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

interface TermSettingProps {
  /** As the form knows it: what is wrong with it, and whether it can be searched. */
  setting: Field | undefined
  schema: Schema
  value: Json
  form: Form
  onChange: (value: Json) => void
}

/** A setting of a term: one value, or what a study tries. */
function TermSetting({ setting, schema, value, form, onChange }: TermSettingProps) {
  const search = useSearched(setting, form.values)
  const error = setting && problemOf(form.problems, setting.key)
  if (setting && search?.searched)
    return (
      <SearchInput
        field={setting}
        label={schema.title}
        searched={search.searched}
        error={error}
        size="xs"
        className={classes.searched}
        onChange={search.set}
      />
    )
  const more = setting && search && (
    <TryMany field={setting} onClick={() => search.set(freshSearch(setting, value))} />
  )
  return (
    <Setting
      id={setting && fieldId(setting.key)}
      schema={schema}
      value={value}
      error={error}
      more={more}
      onChange={onChange}
    />
  )
}

/** "mine", or "mine_2" where that is taken. */
function freeLabel(label: string, terms: readonly Term[]): string {
  const taken = new Set(terms.map((term) => term.label))
  let free = label
  for (let number = 2; taken.has(free); number += 1) free = `${label}_${number}`
  return free
}
