/** The projects that one may see; administrators add some. */
import { Anchor, Button, Group, Table, TextInput } from '@mantine/core'
import { useState } from 'react'
import { Link } from 'react-router'
import { useAccount } from '../api/account'
import { $api } from '../api/client'
import { Pager } from '../components/Pager'
import { Rows } from '../components/people/Rows'
import { useChange } from '../components/people/useChange'
import { Page, Panel } from '../components/ui'
import { count } from '../lib/format'
import { useTitle } from '../lib/hooks'

const SIZE = 50

export function ProjectsPage() {
  useTitle('Projects')
  const settle = useChange()
  const { data: account } = useAccount()
  const [page, setPage] = useState(1)
  const [name, setName] = useState('')
  const projects = $api.useQuery('get', '/api/projects', {
    params: { query: { limit: SIZE, offset: (page - 1) * SIZE } },
  })
  const create = $api.useMutation('post', '/api/projects', settle('add the project'))
  return (
    <Page title="Projects">
      <Panel flush>
        {account?.administrates && (
          <Group
            component="form"
            align="end"
            gap="sm"
            p="md"
            onSubmit={(event) => {
              event.preventDefault()
              create.mutate({ body: { name } }, { onSuccess: () => setName('') })
            }}
          >
            <TextInput
              label="New project"
              maxLength={80}
              value={name}
              onChange={(event) => setName(event.currentTarget.value)}
            />
            <Button type="submit" loading={create.isPending} disabled={name.trim() === ''}>
              Add
            </Button>
          </Group>
        )}
        <Rows
          what="Projects"
          head={['Project', 'Trainings', 'You are']}
          query={projects}
          empty="You are in no project yet: ask for an invitation to one."
        >
          {projects.data?.items.map((project) => (
            <Table.Tr key={project.id} data-testid="project">
              <Table.Td>
                {project.role === 'admin' ? (
                  <Anchor component={Link} to={`/projects/${project.id}`} size="sm">
                    {project.name}
                  </Anchor>
                ) : (
                  project.name
                )}
              </Table.Td>
              <Table.Td>{count(project.experiments)}</Table.Td>
              <Table.Td>{project.role}</Table.Td>
            </Table.Tr>
          ))}
        </Rows>
        <Pager
          page={page}
          size={SIZE}
          total={projects.data?.total ?? 0}
          label="Pages of projects"
          onChange={setPage}
        />
      </Panel>
    </Page>
  )
}
