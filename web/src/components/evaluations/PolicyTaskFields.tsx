/** What a policy from elsewhere is for, in the fields of a new training: robot, LiDAR, observation, timing. */
import { Skeleton, Stack, Text, Title } from '@mantine/core'
import { useDebouncedValue } from '@mantine/hooks'
import { useMemo } from 'react'
import { $api } from '../../api/client'
import { ApiError } from '../../api/errors'
import type { components } from '../../api/schema'
import { faultsOf } from '../../form/faults'
import classes from '../../form/form.module.css'
import { type Field, fieldsOf } from '../../form/layout'
import { problemsByPath } from '../../form/problems'
import { FieldGrid } from '../../form/SchemaForm'
import { type Json, resolve, type Schema } from '../../form/schema'
import type { Form } from '../../form/useForm'
import { significant, words } from '../../lib/format'

type PolicyShapes = components['schemas']['PolicyShapes']
export type Task = components['schemas']['PolicyTask']['task']

/** Of a task, what a policy sees and commands; where it drives and what it is paid for is not its own. */
const SECTIONS: readonly { title: string; parts: readonly string[] }[] = [
  { title: 'Robot', parts: ['robot'] },
  { title: 'LiDAR', parts: ['lidar'] },
  { title: 'Observation', parts: ['observation', 'collision_distance'] },
  { title: 'Timing and odometry', parts: ['control_period', 'command_delay', 'odometry'] },
]
/** While a number is being typed, the server is not asked about every digit. */
const REST_MS = 400

/** The fields of a task, in a form whose values are `{ task }`. */
export function taskFields(root: Schema, values: Json): Field[] {
  const training = resolve(root.properties?.training ?? {}, root)
  const task = resolve(training.properties?.task ?? {}, root)
  const some = SECTIONS.flatMap(({ parts }) => parts).flatMap((key) => {
    const one = task.properties?.[key]
    return one ? [[key, one] as const] : []
  })
  const only = { ...task, properties: Object.fromEntries(some) }
  return fieldsOf({ properties: { task: only } }, root, values)
}

interface PolicyTaskFieldsProps {
  form: Form
  fields: readonly Field[]
  root: Schema
  /** Of a fresh form. */
  initial: Json
}

export function PolicyTaskFields({ form, fields, root, initial }: PolicyTaskFieldsProps) {
  const faults = faultsOf(fields, root, form.values)
  const sound = Object.keys(faults).length === 0
  const [asked] = useDebouncedValue(sound ? form.values : null, REST_MS)
  const { data, error } = $api.useQuery(
    'post',
    '/api/uploads/shapes',
    { body: asked as unknown as { task: Task } },
    { enabled: asked !== null, staleTime: Number.POSITIVE_INFINITY, retry: false },
  )
  const refused = useMemo(
    () => (sound && error instanceof ApiError ? problemsByPath(error.problems, asked) : {}),
    [sound, error, asked],
  )
  const told = { ...form, problems: { ...form.problems, ...refused, ...faults } }
  // What does not fit together is no single field's.
  const together = told.problems.task
  return (
    <Stack gap="lg" role="group" aria-label="What it is for">
      {SECTIONS.map(({ title, parts }) => {
        const some = fields.filter(({ path }) => parts.includes(String(path[1])))
        if (some.length === 0) return null
        return (
          <section key={title}>
            <Title order={3} size="h4" className={classes.heading}>
              {title}
            </Title>
            <FieldGrid fields={some} form={told} root={root} initial={initial} />
          </section>
        )
      })}
      {together && (
        <Text size="sm" c="red" role="alert">
          {together}
        </Text>
      )}
      {data && sound && !error ? (
        <Shapes shapes={data} />
      ) : (
        !error && <Skeleton height={40} visible={sound} aria-label="What the file has to be" />
      )}
    </Stack>
  )
}

function Shapes({ shapes: { observation, parts, actions } }: { shapes: PolicyShapes }) {
  const seen = parts.map(({ name, numbers }) => `${words(name).toLowerCase()} ${numbers}`)
  const given = actions.map(
    ({ name, low, high, unit }) => `${name} ${significant(low, 3)} to ${significant(high, 3)} ${unit}`,
  )
  return (
    <Text size="sm" data-testid="shapes">
      For these the file takes “observation” (n, {observation}): {seen.join(', ')}; and gives “action” (n,{' '}
      {actions.length}) in fractions of {given.join(', ')}.
    </Text>
  )
}
