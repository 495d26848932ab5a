/** The policy that a training begins with: searched for among one's own checkpoints and those that ship. */
import { Anchor, Select, Text } from '@mantine/core'
import { useDebouncedValue } from '@mantine/hooks'
import { useState } from 'react'
import { $api, api } from '../api/client'
import { messageOf } from '../api/errors'
import type { StartFrom, StartPolicy, TrainingConfig } from '../api/types'
import { percent } from '../lib/format'
import { fieldId } from './FieldInput'
import type { Field } from './layout'
import { problemOf } from './problems'
import type { Json } from './schema'
import type { Form } from './useForm'
import { pathKey, valueAt } from './values'

const PATH = ['training', 'start_from'] as const
const REST_MS = 250

/** What a summary of problems knows it by: the schema hides it from the form's other fields. */
export const START_FIELD: Field = {
  kind: 'text',
  path: PATH,
  key: pathKey(PATH),
  label: 'Start from',
  schema: {},
  nullable: true,
  advanced: false,
  trail: [],
}

const idOf = ({ source, name }: Pick<StartFrom, 'source' | 'name'>) => `${source}:${name}`

export function StartFromInput({ form }: { form: Form }) {
  const chosen = (valueAt(form.values, PATH) ?? null) as StartFrom | null
  const [text, setText] = useState(chosen?.title ?? '')
  const searched = text === chosen?.title ? '' : text
  const [rested] = useDebouncedValue(searched, REST_MS)
  const [failed, setFailed] = useState<string>()
  const found = $api.useQuery(
    'get',
    '/api/training/starts',
    { params: { query: { search: rested } } },
    { placeholderData: (before) => before },
  )
  const policies = found.data ?? []
  const own = policies.filter(({ kind }) => kind !== 'shipped').map(optionOf)
  const shipped = policies.filter(({ kind }) => kind === 'shipped').map(optionOf)
  const isListed = [...own, ...shipped].some(({ value }) => chosen && value === idOf(chosen))
  const problem = problemOf(form.problems, START_FIELD.key)

  /** Sets everything that has to fit to what the policy was trained with. */
  async function takeOver(start: StartFrom) {
    try {
      setFailed(undefined)
      const { task, algorithm } = await trainingOf(start)
      const training = valueAt(form.values, ['training']) as { [key: string]: Json }
      form.set(['training'], { ...training, task, algorithm } as unknown as Json)
    } catch (error) {
      setFailed(messageOf(error))
    }
  }

  return (
    <div>
      <Select
        id={fieldId(START_FIELD.key)}
        label={START_FIELD.label}
        placeholder="Fresh weights"
        searchable
        clearable
        maxDropdownHeight={320}
        nothingFoundMessage={found.error ? messageOf(found.error) : 'No policy is called so'}
        // The server has searched already.
        filter={({ options }) => options}
        searchValue={text}
        onSearchChange={setText}
        error={problem}
        description="A policy whose weights it begins with. It has to see and do the same, with the same network."
        inputWrapperOrder={['label', 'input', 'error', 'description']}
        data={[
          ...(chosen && !isListed
            ? [{ group: 'Chosen', items: [{ value: idOf(chosen), label: chosen.title || chosen.name }] }]
            : []),
          { group: 'Of your runs, the best and the last', items: own },
          { group: 'Policies that ship', items: shipped },
        ]}
        renderOption={({ option }) => {
          const policy = policies.find(({ start_from }) => idOf(start_from) === option.value)
          return (
            <div>
              <Text size="sm">{option.label}</Text>
              {policy && (
                <Text size="xs" c="dimmed">
                  {detailOf(policy)}
                </Text>
              )}
            </div>
          )
        }}
        value={chosen && idOf(chosen)}
        onChange={(id) => {
          const policy = policies.find(({ start_from }) => idOf(start_from) === id)
          if (id === null) form.set(PATH, null)
          else if (policy) form.set(PATH, policy.start_from as unknown as Json)
        }}
      />
      {chosen && problem && (
        <Text size="xs" mt={4}>
          <Anchor component="button" type="button" inherit onClick={() => takeOver(chosen)}>
            Take over its task, algorithm and network
          </Anchor>
        </Text>
      )}
      {failed && (
        <Text size="xs" c="red" mt={4} role="alert">
          {failed}
        </Text>
      )}
    </div>
  )
}

/** The settings of the training that made a policy. */
async function trainingOf({ source, name }: StartFrom): Promise<TrainingConfig> {
  if (source === 'shipped') {
    const { data } = await api.GET('/api/policies/{name}', { params: { path: { name } } })
    if (data) return data.training
  }
  const start = await api.GET('/api/checkpoints/{checkpoint_id}/start', {
    params: { path: { checkpoint_id: name } },
  })
  const made = await api.GET('/api/experiments/{experiment_id}', {
    params: { path: { experiment_id: start.data?.experiment_id ?? '' } },
  })
  if (!made.data) throw new Error('The training that made it is not there')
  return made.data.training
}

const optionOf = ({ start_from }: StartPolicy) => ({
  value: idOf(start_from),
  label: start_from.title || start_from.name,
})

const KINDS = { best: 'the best of its run', last: 'the last of its run', other: '', shipped: '' }

const detailOf = ({ kind, success }: StartPolicy): string =>
  [KINDS[kind], success && `success ${percent(success.value)}`].filter(Boolean).join(', ')
