/** The fields of a form in two parts: what most people set, and everything else under *Advanced*. */
import { Accordion, Anchor, Input, Text, TextInput, Title } from '@mantine/core'
import { useEffect, useRef, useState } from 'react'
import { IconAdjustmentsHorizontal, IconSearch } from '../components/icons'
import { Notice } from '../components/ui'
import { FieldInput, fieldId } from './FieldInput'
import classes from './form.module.css'
import { labelsOf } from './labels'
import { type Field, grouped, initialOf } from './layout'
import type { Problems } from './problems'
import type { Json, Schema } from './schema'
import type { Form } from './useForm'
import { pathKey, sameValue, valueAt } from './values'

interface FieldGridProps {
  fields: readonly Field[]
  form: Form
  root: Schema
  initial: Json
}

export function FieldGrid({ fields, ...rest }: FieldGridProps) {
  return (
    <div className={classes.grid}>
      {fields.map((field) => (
        <FieldInput key={field.key} field={field} {...rest} />
      ))}
    </div>
  )
}

interface AdvancedFieldsProps extends FieldGridProps {
  /** What kept the form from being launched. */
  refused: Problems
}

/** Everything else, by heading; made when it is first opened, which it is by itself where something inside was refused. */
export function AdvancedFields({ fields, refused, ...rest }: AdvancedFieldsProps) {
  const { form, initial } = rest
  const [open, setOpen] = useState<string | null>(null)
  const [made, setMade] = useState(false)
  if (open !== null && !made) setMade(true)
  const [search, setSearch] = useState('')
  const troubled = fields.some((field) =>
    Object.keys(refused).some((path) => isAt(field, path) || path === parentOf(field)),
  )
  useEffect(() => {
    if (!troubled) return
    setOpen('advanced')
    setSearch('')
  }, [troubled])
  const changed = fields.filter(
    (field) => !sameValue(valueAt(form.values, field.path), initialOf(field, form.values, initial)),
  ).length
  const found = fields.filter((field) => isCalled(field, search))
  return (
    <Accordion variant="contained" className={classes.advanced} value={open} onChange={setOpen}>
      <Accordion.Item value="advanced">
        <Accordion.Control icon={<IconAdjustmentsHorizontal size={18} stroke={1.6} />}>
          Advanced
          <Text component="span" size="xs" c="dimmed" ml={10}>
            {fields.length} more settings{changed > 0 && `, ${changed} changed from the default`}
          </Text>
        </Accordion.Control>
        <Accordion.Panel>
          <TextInput
            aria-label="Search these settings"
            placeholder="Search these settings"
            leftSection={<IconSearch size={16} stroke={1.6} />}
            mb="lg"
            value={search}
            onChange={(event) => setSearch(event.currentTarget.value)}
          />
          {found.length === 0 && (
            <Text size="sm" c="dimmed">
              None of these settings is called so.
            </Text>
          )}
          {grouped(made ? found : []).map(([heading, some]) => (
            <section key={heading} className={classes.group}>
              <Title order={2} size="h3" className={classes.heading}>
                {heading}
              </Title>
              <GroupProblem fields={some} problems={form.problems} />
              <FieldGrid fields={some} {...rest} />
            </section>
          ))}
        </Accordion.Panel>
      </Accordion.Item>
    </Accordion>
  )
}

/** Whether every word of a search is in a field's label, headings or description. */
function isCalled({ label, trail, schema }: Field, search: string): boolean {
  const text = [label, ...trail, schema.description].join(' ').toLocaleLowerCase()
  return search
    .toLocaleLowerCase()
    .split(/\s+/)
    .every((word) => text.includes(word))
}

/** What is wrong with the fields of a group together, such as two that don't fit each other. */
function GroupProblem({ fields, problems }: { fields: readonly Field[]; problems: Problems }) {
  const parents = [...new Set(fields.map(parentOf))]
  const messages = parents.flatMap((path) => problems[path] ?? [])
  return messages.length > 0 ? <Input.Error mb="sm">{messages.join('; ')}</Input.Error> : null
}

/** The path of the object that a field belongs to. */
const parentOf = (field: Field): string => pathKey(field.path.slice(0, -1))

/** Whether a problem's path leads to this field: to itself, or into its list. */
function isAt(field: Field, path: string): boolean {
  return path === field.key || (field.kind !== 'union' && path.startsWith(`${field.key}.`))
}

function focusField(field: Field): void {
  const control = document.getElementById(fieldId(field.key))
  control?.scrollIntoView({ block: 'center' })
  // A group of radio buttons takes the focus through the chosen one.
  const input = control?.querySelector<HTMLInputElement>('input:checked') ?? control
  input?.focus({ preventScroll: true })
}

interface ProblemSummaryProps {
  fields: readonly Field[]
  problems: Problems
  root: Schema
}

/** All that the server refused, each leading to its field; comes into view when there is something new. */
export function ProblemSummary({ fields, problems, root }: ProblemSummaryProps) {
  const summary = useRef<HTMLDivElement>(null)
  const entries = Object.entries(problems)
  const refused = entries.length > 0
  useEffect(() => {
    if (refused) summary.current?.scrollIntoView({ block: 'center' })
  }, [refused])
  if (!refused) return null
  return (
    <div ref={summary}>
      <Notice bad title="Not launched: some values were refused" role="alert" data-testid="problems">
        <ul style={{ margin: 0, paddingLeft: 18 }}>
          {entries.map(([path, message]) => {
            // Of a list and a setting of what is in it, the setting.
            const field =
              fields.findLast((one) => isAt(one, path)) ??
              fields.find((one) => path !== '' && parentOf(one) === path)
            return (
              <li key={path}>
                {field && (
                  <>
                    <Anchor component="button" type="button" inherit onClick={() => focusField(field)}>
                      {isAt(field, path) ? field.label : labelsOf(root, path.split('.')).at(-1)}
                    </Anchor>
                    {': '}
                  </>
                )}
                {message}
              </li>
            )
          })}
        </ul>
      </Notice>
    </div>
  )
}
