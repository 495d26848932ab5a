/** Does this policy work there? Ask for it, and see what was asked before. */
import { Button, Group, Skeleton, Stack } from '@mantine/core'
import { useState } from 'react'
import { Link, useSearchParams } from 'react-router'
import { $api } from '../api/client'
import { Below } from '../components/Below'
import { AskForm } from '../components/evaluations/AskForm'
import { EvaluationTable, isOpen } from '../components/evaluations/EvaluationTable'
import { OwnSuites } from '../components/evaluations/OwnSuites'
import { PolicyUpload } from '../components/evaluations/PolicyUpload'
import { UploadedPolicies } from '../components/evaluations/UploadedPolicies'
import { Pager } from '../components/Pager'
import { Message, Page, Panel, QueryError } from '../components/ui'
import { HEADS } from '../heads'
import { useTitle } from '../lib/hooks'

const SIZE = 50
/** How often what is under way is asked after. */
const EVERY_MS = 1_500

export function EvaluationsPage() {
  useTitle(HEADS.EvaluationsPage.title)
  const [page, setPage] = useState(1)
  const [search] = useSearchParams()
  const { data, error, refetch } = $api.useQuery(
    'get',
    '/api/evaluations',
    { params: { query: { limit: SIZE, offset: (page - 1) * SIZE } } },
    { refetchInterval: (query) => (query.state.data?.items.some(isOpen) ? EVERY_MS : false) },
  )
  return (
    <Page
      {...HEADS.EvaluationsPage}
      actions={
        <Group gap="sm">
          <Button component={Link} to="/leaderboards" variant="default">
            Leaderboards
          </Button>
          <Button component={Link} to="/policies#families" variant="default">
            Families
          </Button>
          <Button component={Link} to="/recordings" variant="default">
            From a robot
          </Button>
          <PolicyUpload />
        </Group>
      }
    >
      <Stack gap="md">
        <Panel title="Measure policies">
          {/* Another address is another question. */}
          <AskForm key={search.toString()} />
        </Panel>
        <Below height={400}>
          <OwnSuites />
          <UploadedPolicies />
          <Panel title="Measured" flush>
            {error && !data ? (
              <QueryError error={error} what="list of evaluations" retry={refetch} />
            ) : !data ? (
              <Skeleton height={160} m="md" w="auto" />
            ) : data.items.length === 0 ? (
              <Message title="Nothing was evaluated yet">
                Choose policies above, and what they are to be measured on.
              </Message>
            ) : (
              <EvaluationTable evaluations={data.items} />
            )}
            <Pager
              page={page}
              size={SIZE}
              total={data?.total ?? 0}
              label="Pages of evaluations"
              onChange={setPage}
            />
          </Panel>
        </Below>
      </Stack>
    </Page>
  )
}
