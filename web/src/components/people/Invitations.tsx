/** Invitations that still hold. */
import { Button, Table } from '@mantine/core'
import { $api } from '../../api/client'
import { dateTime } from '../../lib/format'
import { Panel } from '../ui'
import { Rows } from './Rows'
import { useChange } from './useChange'

/** Of one project where it is given. */
export function Invitations({ projectId }: { projectId?: string }) {
  const change = useChange()
  const invitations = $api.useQuery('get', '/api/invitations')
  const withdraw = $api.useMutation(
    'delete',
    '/api/invitations/{invitation_id}',
    change('withdraw the invitation'),
  )
  const shown = invitations.data?.filter((each) => projectId === undefined || each.project_id === projectId)
  return (
    <Panel title="Open invitations" flush>
      <Rows
        what="Open invitations"
        head={['For', 'As', 'Invited by', 'Ends', '']}
        query={invitations}
        empty="No link waits to be used."
      >
        {shown?.map((each) => (
          <Table.Tr key={each.id} data-testid="invitation">
            <Table.Td>{each.note || '–'}</Table.Td>
            <Table.Td>{each.admin ? 'administrator' : `${each.role} in ${each.project}`}</Table.Td>
            <Table.Td>{each.invited_by}</Table.Td>
            <Table.Td>{dateTime(each.expires_at)}</Table.Td>
            <Table.Td ta="right">
              <Button
                size="compact-xs"
                variant="default"
                onClick={() => withdraw.mutate({ params: { path: { invitation_id: each.id } } })}
              >
                Withdraw
              </Button>
            </Table.Td>
          </Table.Tr>
        ))}
      </Rows>
    </Panel>
  )
}
