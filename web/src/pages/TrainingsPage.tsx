/** Home: all experiments, to find, to tick for comparison, and to act upon. */
import { Button, Group, Select, TextInput } from '@mantine/core'
import { useDebouncedValue } from '@mantine/hooks'
import { keepPreviousData } from '@tanstack/react-query'
import { useState } from 'react'
import { Link, useNavigate } from 'react-router'
import { $api } from '../api/client'
import type { ExperimentState } from '../api/types'
import { ExperimentTable } from '../components/ExperimentTable'
import { IconArrowsDiff, IconPlus, IconRobot, IconSearch } from '../components/icons'
import { STATES } from '../components/states'
import { Message, Page, Panel, QueryError } from '../components/ui'
import { plural } from '../lib/format'
import { useTitle } from '../lib/hooks'

const PAGE_SIZE = 50

export function TrainingsPage() {
  useTitle('Trainings')
  const navigate = useNavigate()
  const [text, setText] = useState('')
  const [query] = useDebouncedValue(text.trim(), 200)
  const [state, setState] = useState<ExperimentState | null>(null)
  const [shown, setShown] = useState(PAGE_SIZE)
  const [ticked, setTicked] = useState<readonly string[]>([])
  const { data, error, isPending, refetch } = $api.useQuery(
    'get',
    '/api/experiments',
    { params: { query: { query, limit: shown, ...(state ? { state } : {}) } } },
    { placeholderData: keepPreviousData },
  )
  const filtered = query !== '' || state !== null
  const comparison = ticked.map((id) => `experiment=${id}`).join('&')

  return (
    <Page
      title="Trainings"
      actions={
        <Group gap="xs">
          <Button
            variant="default"
            leftSection={<IconArrowsDiff size={16} />}
            disabled={ticked.length === 0}
            onClick={() => navigate(`/compare?${comparison}`)}
          >
            {ticked.length === 0 ? 'Compare' : `Compare ${ticked.length}`}
          </Button>
          <Button component={Link} to="/new" leftSection={<IconPlus size={16} />}>
            New training
          </Button>
        </Group>
      }
    >
      {error && !data ? (
        <Panel>
          <QueryError error={error} what="list of trainings" retry={refetch} />
        </Panel>
      ) : data?.total === 0 && !filtered ? (
        <Panel>
          <Message
            icon={<IconRobot size={44} stroke={1.2} />}
            title="Nothing trained yet"
            actions={
              <Group gap="xs" justify="center">
                <Button component={Link} to="/new">
                  Launch your first training
                </Button>
                <Button variant="default" component={Link} to="/reproduction">
                  Reproduce the paper
                </Button>
              </Group>
            }
          >
            The defaults train a robot to find its way in a simple arena within half a minute, and you can
            watch it learn.
          </Message>
        </Panel>
      ) : (
        <>
          <Group gap="xs" mb="sm">
            <TextInput
              aria-label="Search by name"
              placeholder="Search by name"
              leftSection={<IconSearch size={16} />}
              value={text}
              onChange={(event) => setText(event.currentTarget.value)}
              w={{ base: '100%', xs: 260 }}
            />
            <Select
              aria-label="Filter by state"
              placeholder="Any state"
              clearable
              data={Object.entries(STATES).map(([value, { label }]) => ({ value, label }))}
              value={state}
              onChange={(next) => setState(next as ExperimentState | null)}
              w={150}
            />
          </Group>
          <Panel flush>
            <ExperimentTable
              experiments={isPending ? undefined : (data?.items ?? [])}
              ticked={ticked}
              onTick={setTicked}
            />
            {data?.items.length === 0 && (
              <Message
                title="No training matches"
                actions={
                  <Button
                    variant="default"
                    onClick={() => {
                      setText('')
                      setState(null)
                    }}
                  >
                    Show all
                  </Button>
                }
              />
            )}
          </Panel>
          {data && data.items.length < data.total && (
            <Group justify="center" mt="md">
              <Button variant="default" onClick={() => setShown(shown + PAGE_SIZE)}>
                Show more of {plural(data.total, 'training')}
              </Button>
            </Group>
          )}
        </>
      )}
    </Page>
  )
}
