/** What robots recorded: upload a recording, open one that was uploaded. */
import { Anchor, Skeleton, Stack, Table, VisuallyHidden } from '@mantine/core'
import { useState } from 'react'
import { Link } from 'react-router'
import { $api } from '../api/client'
import { DeleteButton } from '../components/DeleteButton'
import { DeleteDialog } from '../components/DeleteDialog'
import table from '../components/ExperimentTable.module.css'
import { Pager } from '../components/Pager'
import { useChange } from '../components/people/useChange'
import { RecordingUpload } from '../components/recordings/RecordingUpload'
import { Message, Page, Panel, QueryError } from '../components/ui'
import ui from '../components/ui.module.css'
import { HEADS } from '../heads'
import { age, dateTime, fileSize } from '../lib/format'
import { useNow, useTitle } from '../lib/hooks'

const SIZE = 50

export function RecordingsPage() {
  useTitle(HEADS.RecordingsPage.title)
  const now = useNow()
  const settle = useChange()
  const [page, setPage] = useState(1)
  const [going, setGoing] = useState<{ id: string; name: string }>()
  const { data, error, refetch } = $api.useQuery('get', '/api/recordings', {
    params: { query: { limit: SIZE, offset: (page - 1) * SIZE } },
  })
  const remove = $api.useMutation('delete', '/api/recordings/{recording_id}', settle('delete the recording'))
  return (
    <Page {...HEADS.RecordingsPage}>
      <Stack gap="md">
        <Panel>
          <RecordingUpload />
        </Panel>
        <Panel title="Recordings" flush>
          {error && !data ? (
            <QueryError error={error} what="list of recordings" retry={refetch} />
          ) : !data ? (
            <Skeleton height={120} m="md" w="auto" />
          ) : data.items.length === 0 ? (
            <Message title="No recording yet">
              See what a policy would have done on your robot, and train with the noise, the delay and the
              acceleration that it really has.
            </Message>
          ) : (
            <Table.ScrollContainer type="native" minWidth={320}>
              <Table className={table.table} highlightOnHover aria-label="Recordings">
                <Table.Thead>
                  <Table.Tr>
                    <Table.Th>Recording</Table.Th>
                    <Table.Th ta="right">Size</Table.Th>
                    <Table.Th>Uploaded</Table.Th>
                    <Table.Th w={44}>
                      <VisuallyHidden>Actions</VisuallyHidden>
                    </Table.Th>
                  </Table.Tr>
                </Table.Thead>
                <Table.Tbody>
                  {data.items.map((each) => (
                    <Table.Tr key={each.id} data-testid="recording">
                      <Table.Td>
                        <Anchor component={Link} to={`/recordings/${each.id}`} size="sm" fw={550}>
                          {each.name}
                        </Anchor>
                      </Table.Td>
                      <Table.Td ta="right" className={ui.number}>
                        {fileSize(each.size)}
                      </Table.Td>
                      <Table.Td title={dateTime(each.created_at)}>{age(each.created_at, now)}</Table.Td>
                      <Table.Td ta="right">
                        <DeleteButton name={each.name} onClick={() => setGoing(each)} />
                      </Table.Td>
                    </Table.Tr>
                  ))}
                </Table.Tbody>
              </Table>
            </Table.ScrollContainer>
          )}
          <Pager
            page={page}
            size={SIZE}
            total={data?.total ?? 0}
            label="Pages of recordings"
            onChange={setPage}
          />
        </Panel>
      </Stack>
      <DeleteDialog
        opened={going !== undefined}
        what={`“${going?.name ?? ''}”`}
        busy={remove.isPending}
        onClose={() => setGoing(undefined)}
        onDelete={() =>
          going &&
          remove.mutate(
            { params: { path: { recording_id: going.id } } },
            { onSuccess: () => setGoing(undefined) },
          )
        }
      >
        The file is removed for good; trainings that began with what was fitted keep their settings.
      </DeleteDialog>
    </Page>
  )
}
