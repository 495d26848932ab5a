/** The API in words: how to begin, and every operation, from the description that the server writes of itself. */
import { Group, Skeleton, Stack, Text, TextInput } from '@mantine/core'
import { useState } from 'react'
import { errorOf } from '../api/errors'
import { useInSlices } from '../api/useInSlices'
import { IconSearch } from '../components/icons'
import { Page, Panel, QueryError } from '../components/ui'
import { HEADS } from '../heads'
import { at } from '../lib/base'
import { plural, words } from '../lib/format'
import { useTitle } from '../lib/hooks'
import classes from './ApiPage.module.css'

const DESCRIPTION = at('/api/openapi.json')

interface Parameter {
  name: string
  in: string
  required?: boolean
  description?: string
}

interface Operation {
  tags?: string[]
  description?: string
  summary?: string
  parameters?: Parameter[]
  requestBody?: { content?: Record<string, { schema?: { $ref?: string } }> }
}

interface OpenApi {
  paths: Record<string, Record<string, Operation>>
}

interface Listed extends Operation {
  method: string
  path: string
}

export function ApiPage() {
  useTitle(HEADS.ApiPage.title)
  const [search, setSearch] = useState('')
  const { data, error, refetch } = useInSlices({
    queryKey: [DESCRIPTION],
    queryFn: async ({ signal }): Promise<OpenApi> => {
      const response = await fetch(new Request(new URL(DESCRIPTION, window.location.origin), { signal }))
      if (!response.ok) throw await errorOf(response)
      return response.json()
    },
    staleTime: Number.POSITIVE_INFINITY,
  })
  const found = data ? operationsOf(data).filter((one) => isCalled(one, search)) : []
  return (
    <Page {...HEADS.ApiPage}>
      {error ? (
        <Panel>
          <QueryError error={error} what="description" retry={() => void refetch()} />
        </Panel>
      ) : (
        <Stack gap="md">
          <Group gap="sm">
            <TextInput
              aria-label="Search the operations"
              placeholder="Search the operations"
              leftSection={<IconSearch size={16} stroke={1.6} />}
              value={search}
              onChange={(event) => setSearch(event.currentTarget.value)}
            />
            <Text size="sm" c="dimmed" role="status">
              {data ? plural(found.length, 'operation') : ''}
            </Text>
          </Group>
          {!data && (
            <Panel>
              <Skeleton height={240} />
            </Panel>
          )}
          {tagsOf(found).map(([tag, operations]) => (
            <Panel key={tag} title={words(tag)}>
              <ul className={classes.operations}>
                {operations.map((operation) => (
                  <OperationRow key={`${operation.method} ${operation.path}`} {...operation} />
                ))}
              </ul>
            </Panel>
          ))}
        </Stack>
      )}
    </Page>
  )
}

function OperationRow({ method, path, description, summary, parameters = [], requestBody }: Listed) {
  const body = Object.values(requestBody?.content ?? {})[0]
    ?.schema?.$ref?.split('/')
    .at(-1)
  const asked = parameters.filter((one) => one.in === 'query')
  return (
    <li data-testid="operation">
      <code className={classes.call}>
        <span data-method={method}>{method}</span> {path.replace(/([/_])/g, '$1\u200b')}
      </code>
      <Text size="sm">{plainly(description ?? summary ?? '')}</Text>
      {(asked.length > 0 || body) && (
        <Text size="xs" c="dimmed">
          {[
            asked.length > 0 ? `Asked with ${asked.map(({ name }) => name).join(', ')}` : '',
            body ? `Sends ${body}` : '',
          ]
            .filter(Boolean)
            .join('. ')}
        </Text>
      )}
    </li>
  )
}

/** A docstring without its marks of code and its line breaks. */
const plainly = (text: string): string => text.replaceAll('`', '').replace(/\s+/g, ' ')

const operationsOf = ({ paths }: OpenApi): Listed[] =>
  Object.entries(paths).flatMap(([path, methods]) =>
    Object.entries(methods).map(([method, operation]) => ({
      ...operation,
      method: method.toUpperCase(),
      path,
    })),
  )

/** Operations by their tag, in the order of the description. */
function tagsOf(operations: readonly Listed[]): [tag: string, operations: Listed[]][] {
  const tags = new Map<string, Listed[]>()
  for (const operation of operations) {
    const tag = operation.tags?.[0] ?? 'other'
    tags.set(tag, [...(tags.get(tag) ?? []), operation])
  }
  return [...tags]
}

/** Whether every word of a search is in an operation's call or description. */
function isCalled({ method, path, description, tags = [] }: Listed, search: string): boolean {
  const text = [method, path, description, ...tags].join(' ').toLocaleLowerCase()
  return search
    .toLocaleLowerCase()
    .split(/\s+/)
    .every((word) => text.includes(word))
}
