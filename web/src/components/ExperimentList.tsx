/** All experiments, a page at a time, to find and to tick. */
import { Button, Group, Select, TextInput } from '@mantine/core'
import { useDebouncedValue } from '@mantine/hooks'
import { keepPreviousData } from '@tanstack/react-query'
import { type ReactNode, useState } from 'react'
import { $api } from '../api/client'
import type { ExperimentState } from '../api/types'
import { useNumberInAddress } from '../lib/hooks'
import { ExperimentTable } from './ExperimentTable'
import { IconSearch } from './icons'
import { Pager } from './Pager'
import { STATES } from './states'
import { Message, Panel, QueryError } from './ui'

const PAGE_SIZE = 50

interface ExperimentListProps {
  ticked: readonly string[]
  onTick: (ids: readonly string[]) => void
  /** What stands in place of the list before the first training. */
  empty: ReactNode
  /** Without the menus: a picker. */
  menu?: boolean
}

export function ExperimentList({ ticked, onTick, empty, menu = true }: ExperimentListProps) {
  const [text, setText] = useState('')
  const [query] = useDebouncedValue(text.trim(), 200)
  const [state, setState] = useState<ExperimentState | null>(null)
  const [inAddress, setPage] = useNumberInAddress('page')
  const page = Math.max(1, inAddress ?? 1)
  const { data, error, isPending, refetch } = $api.useQuery(
    'get',
    '/api/experiments',
    {
      params: {
        query: { query, limit: PAGE_SIZE, offset: (page - 1) * PAGE_SIZE, ...(state ? { state } : {}) },
      },
    },
    { placeholderData: keepPreviousData },
  )
  const show = (change: () => void) => {
    change()
    setPage(null)
  }

  if (error && !data) {
    return (
      <Panel>
        <QueryError error={error} what="list of trainings" retry={refetch} />
      </Panel>
    )
  }
  if (data?.total === 0 && query === '' && state === null) return <Panel>{empty}</Panel>
  return (
    <>
      <Group gap="xs" mb="sm">
        <TextInput
          aria-label="Search by name"
          placeholder="Search by name"
          leftSection={<IconSearch size={16} />}
          value={text}
          onChange={({ currentTarget }) => show(() => setText(currentTarget.value))}
          w={{ base: '100%', xs: 260 }}
        />
        <Select
          aria-label="Filter by state"
          placeholder="Any state"
          clearable
          data={Object.entries(STATES).map(([value, { label }]) => ({ value, label }))}
          value={state}
          onChange={(next) => show(() => setState(next as ExperimentState | null))}
          w={150}
        />
      </Group>
      <Panel flush>
        <ExperimentTable
          experiments={isPending ? undefined : (data?.items ?? [])}
          ticked={ticked}
          onTick={onTick}
          menu={menu}
        />
        {data?.total === 0 && (
          <Message
            title="No training matches"
            actions={
              <Button
                variant="default"
                onClick={() =>
                  show(() => {
                    setText('')
                    setState(null)
                  })
                }
              >
                Show all
              </Button>
            }
          />
        )}
        {data && (
          <Pager
            page={page}
            size={PAGE_SIZE}
            total={data.total}
            label="Pages of trainings"
            onChange={setPage}
          />
        )}
      </Panel>
    </>
  )
}
