/** A project, for those who administrate it: its members, and links that invite more. */
import { Badge, Button, Select, Stack, Table } from '@mantine/core'
import { useState } from 'react'
import { useParams } from 'react-router'
import { $api } from '../api/client'
import type { Role } from '../api/types'
import { Pager } from '../components/Pager'
import { Invitations } from '../components/people/Invitations'
import { InviteForm } from '../components/people/InviteForm'
import { Rows } from '../components/people/Rows'
import { useChange } from '../components/people/useChange'
import { Page, Panel, Within } from '../components/ui'
import { HEADS } from '../heads'
import { useTitle } from '../lib/hooks'

const SIZE = 50

export function ProjectPage() {
  const { projectId = '' } = useParams()
  const settle = useChange()
  const [page, setPage] = useState(1)
  const projects = $api.useQuery('get', '/api/projects', { params: { query: { limit: 200 } } })
  const project = projects.data?.items.find(({ id }) => id === projectId)
  useTitle(project?.name ?? HEADS.ProjectPage.title)
  const members = $api.useQuery('get', '/api/projects/{project_id}/members', {
    params: { path: { project_id: projectId }, query: { limit: SIZE, offset: (page - 1) * SIZE } },
  })
  const change = $api.useMutation(
    'put',
    '/api/projects/{project_id}/members/{user_id}',
    settle('change the role'),
  )
  const remove = $api.useMutation(
    'delete',
    '/api/projects/{project_id}/members/{user_id}',
    settle('take the member out'),
  )
  const of = (userId: string) => ({ params: { path: { project_id: projectId, user_id: userId } } })
  return (
    <Page
      title={project?.name ?? HEADS.ProjectPage.title}
      about={HEADS.ProjectPage.about}
      above={<Within page="ProjectPage" />}
    >
      <Stack gap="md">
        <Panel title="Members" flush>
          <Rows
            what="Members"
            head={['Name', 'Role', '']}
            query={members}
            empty="Nobody yet: invite somebody."
          >
            {members.data?.items.map((member) => (
              <Table.Tr key={member.user_id} data-testid="member">
                <Table.Td>
                  {member.name} {member.disabled && <Badge color="gray">closed</Badge>}
                </Table.Td>
                <Table.Td>
                  <Select
                    size="xs"
                    w={120}
                    aria-label={`Role of ${member.name}`}
                    allowDeselect={false}
                    data={['viewer', 'editor', 'admin']}
                    value={member.role}
                    onChange={(role) =>
                      role && change.mutate({ ...of(member.user_id), body: { role: role as Role } })
                    }
                  />
                </Table.Td>
                <Table.Td ta="right">
                  <Button
                    size="compact-xs"
                    variant="default"
                    onClick={() => remove.mutate(of(member.user_id))}
                  >
                    Take out
                  </Button>
                </Table.Td>
              </Table.Tr>
            ))}
          </Rows>
          <Pager
            page={page}
            size={SIZE}
            total={members.data?.total ?? 0}
            label="Pages of members"
            onChange={setPage}
          />
        </Panel>
        {(project || projects.isPending) && (
          <Panel title="Invite">
            <InviteForm key={project?.id ?? ''} projects={project ? [project] : []} />
          </Panel>
        )}
        <Invitations projectId={projectId} />
      </Stack>
    </Page>
  )
}
