/** Which settings are best? Every search, and how far it is. */
import { Anchor, Button, Skeleton, Table } from '@mantine/core'
import { useState } from 'react'
import { Link } from 'react-router'
import { $api } from '../api/client'
import table from '../components/ExperimentTable.module.css'
import { Pager } from '../components/Pager'
import { SAMPLERS } from '../components/studies/StudySettings'
import { StudyStateLabel } from '../components/studies/StudyStateLabel'
import { goesOn, type ListedStudy, STUDY_STATES } from '../components/studies/study'
import { Message, Page, Panel, ProgressBar, QueryError } from '../components/ui'
import ui from '../components/ui.module.css'
import { HEADS } from '../heads'
import { age, dateTime, percent } from '../lib/format'
import { useNow, useTitle } from '../lib/hooks'

const SIZE = 50
/** How often what goes on is asked after. */
const EVERY_MS = 3_000

export function StudiesPage() {
  useTitle(HEADS.StudiesPage.title)
  const [page, setPage] = useState(1)
  const { data, error, refetch } = $api.useQuery(
    'get',
    '/api/studies',
    { params: { query: { limit: SIZE, offset: (page - 1) * SIZE } } },
    { refetchInterval: (query) => (query.state.data?.items.some(goesOn) ? EVERY_MS : false) },
  )
  return (
    <Page {...HEADS.StudiesPage}>
      <Panel flush>
        {error && !data ? (
          <QueryError error={error} what="list of studies" retry={refetch} />
        ) : !data ? (
          <Skeleton height={160} m="md" w="auto" />
        ) : data.items.length === 0 ? (
          <Message
            title="Nothing was searched yet"
            actions={
              <Button component={Link} to="/new">
                New training
              </Button>
            }
          >
            Once one is launched it stands here: its trials, the best of them, and how much each setting
            matters.
          </Message>
        ) : (
          <StudyTable studies={data.items} />
        )}
        <Pager page={page} size={SIZE} total={data?.total ?? 0} label="Pages of studies" onChange={setPage} />
      </Panel>
    </Page>
  )
}

function StudyTable({ studies }: { studies: readonly ListedStudy[] }) {
  const now = useNow()
  return (
    <Table.ScrollContainer type="native" minWidth={340}>
      <Table className={table.table} highlightOnHover aria-label="Studies">
        <Table.Thead>
          <Table.Tr>
            <Table.Th>Study</Table.Th>
            <Table.Th>State</Table.Th>
            <Table.Th ta="right">Trials</Table.Th>
            <Table.Th ta="right" title="Of the best trial, by the seeds that it was tuned with">
              Best success
            </Table.Th>
            <Table.Th visibleFrom="sm">Chosen by</Table.Th>
            <Table.Th visibleFrom="sm">Launched</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {studies.map((study) => {
            const { as, label } = STUDY_STATES[study.state]
            const through = study.complete + study.pruned + study.failed
            return (
              <Table.Tr key={study.id} data-testid="study">
                <Table.Td>
                  <Anchor component={Link} to={`/studies/${study.id}`} size="sm" fw={550}>
                    {study.name}
                  </Anchor>
                </Table.Td>
                <Table.Td>
                  <StudyStateLabel as={as} label={label} />
                  {study.state === 'running' && (
                    <ProgressBar
                      value={through / study.trials}
                      state={as}
                      label={`Progress of ${study.name}`}
                    />
                  )}
                </Table.Td>
                <Table.Td ta="right" className={ui.number}>
                  {through} of {study.trials}
                </Table.Td>
                <Table.Td ta="right" className={ui.number}>
                  {study.best_success === null ? '–' : percent(study.best_success)}
                </Table.Td>
                <Table.Td visibleFrom="sm">
                  {SAMPLERS.find((one) => one.value === study.sampler)?.label}
                </Table.Td>
                <Table.Td visibleFrom="sm" title={dateTime(study.created_at)}>
                  {age(study.created_at, now)}
                </Table.Td>
              </Table.Tr>
            )
          })}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  )
}
