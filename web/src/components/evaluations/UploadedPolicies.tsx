/** Policies from elsewhere: each can be measured and deleted. */
import { Button, Group, Table } from '@mantine/core'
import { useState } from 'react'
import { Link } from 'react-router'
import { $api } from '../../api/client'
import { fileSize } from '../../lib/format'
import { DeleteButton } from '../DeleteButton'
import { DeleteDialog } from '../DeleteDialog'
import table from '../ExperimentTable.module.css'
import { Pager } from '../Pager'
import { useChange } from '../people/useChange'
import { Panel } from '../ui'
import ui from '../ui.module.css'
import { evaluate, policyKey } from './choices'

const SIZE = 10

export function UploadedPolicies() {
  const [page, setPage] = useState(1)
  const [deleted, setDeleted] = useState<{ id: string; name: string }>()
  const { data } = $api.useQuery('get', '/api/uploads', {
    params: { query: { limit: SIZE, offset: (page - 1) * SIZE } },
  })
  const remove = $api.useMutation('delete', '/api/uploads/{upload_id}', useChange()('delete the policy'))
  if (!data || data.total === 0) return null
  return (
    <Panel title="Uploaded policies" flush>
      <Table.ScrollContainer type="native" minWidth={340}>
        <Table className={table.table} aria-label="Uploaded policies">
          <Table.Thead>
            <Table.Tr>
              <Table.Th>Policy</Table.Th>
              <Table.Th ta="right">Size</Table.Th>
              <Table.Th ta="right">Measure, delete</Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {data.items.map(({ id, name, size }) => (
              <Table.Tr key={id} data-testid="uploaded-policy">
                <Table.Td>{name}</Table.Td>
                <Table.Td ta="right" className={ui.number}>
                  {fileSize(size)}
                </Table.Td>
                <Table.Td>
                  <Group gap="xs" justify="flex-end" wrap="nowrap">
                    <Button
                      component={Link}
                      to={evaluate([policyKey('uploaded', id)])}
                      size="xs"
                      variant="default"
                      aria-label={`Evaluate ${name}`}
                    >
                      Evaluate
                    </Button>
                    <DeleteButton name={name} onClick={() => setDeleted({ id, name })} />
                  </Group>
                </Table.Td>
              </Table.Tr>
            ))}
          </Table.Tbody>
        </Table>
      </Table.ScrollContainer>
      <Pager
        page={page}
        size={SIZE}
        total={data.total}
        label="Pages of uploaded policies"
        onChange={setPage}
      />
      {deleted && (
        <DeleteDialog
          opened
          what={`“${deleted.name}”`}
          busy={remove.isPending}
          onClose={() => setDeleted(undefined)}
          onDelete={() =>
            remove.mutate(
              { params: { path: { upload_id: deleted.id } } },
              { onSettled: () => setDeleted(undefined) },
            )
          }
        >
          Its file goes for good; what was measured of it stays.
        </DeleteDialog>
      )}
    </Panel>
  )
}
