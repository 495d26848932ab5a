/** The projects that one may see, each to look at, to export whole, and to import into; administrators add some. */
import { Anchor, Button, FileButton, Group, Table, TextInput } from '@mantine/core'
import { notifications } from '@mantine/notifications'
import { useMutation } from '@tanstack/react-query'
import { useState } from 'react'
import { Link } from 'react-router'
import { useAccount } from '../api/account'
import { $api, api } from '../api/client'
import type { Project, ProjectImport } from '../api/types'
import { Pager } from '../components/Pager'
import { Rows } from '../components/people/Rows'
import { useChange } from '../components/people/useChange'
import { Page, Panel } from '../components/ui'
import { HEADS } from '../heads'
import { at } from '../lib/base'
import { count, plural } from '../lib/format'
import { useTitle } from '../lib/hooks'

const SIZE = 50

export function ProjectsPage() {
  useTitle(HEADS.ProjectsPage.title)
  const settle = useChange()
  const { data: account } = useAccount()
  const [page, setPage] = useState(1)
  const [name, setName] = useState('')
  const projects = $api.useQuery('get', '/api/projects', {
    params: { query: { limit: SIZE, offset: (page - 1) * SIZE } },
  })
  const create = $api.useMutation('post', '/api/projects', settle('add the project'))
  return (
    <Page {...HEADS.ProjectsPage}>
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
          head={['Project', 'Trainings', 'You are', '']}
          minWidth={620}
          query={projects}
          empty="You are in no project yet: ask for an invitation to one."
        >
          {projects.data?.items.map((project) => (
            <Table.Tr key={project.id} data-testid="project">
              <Table.Td>
                <Anchor component={Link} to={`/?project=${project.id}`} size="sm">
                  {project.name}
                </Anchor>
              </Table.Td>
              <Table.Td>{count(project.experiments)}</Table.Td>
              <Table.Td>{project.role}</Table.Td>
              <Table.Td>
                <ProjectTools project={project} people={account?.people === true} />
              </Table.Td>
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

/** What one may do with a project: its members, its archive out, another server's archive in. */
function ProjectTools({ project, people }: { project: Project; people: boolean }) {
  const settle = useChange()
  const take = useMutation({
    mutationFn: async (file: File) => {
      const { data } = await api.POST('/api/projects/{project_id}/import', {
        params: { path: { project_id: project.id } },
        body: file as unknown as string,
        bodySerializer: (body) => body,
        headers: { 'Content-Type': 'application/x-tar' },
      })
      return data
    },
    ...settle('import the archive'),
    onSuccess: (came) => came && notifications.show(importNews(came)),
  })
  return (
    <Group gap={6} justify="flex-end" wrap="nowrap">
      {people && project.role === 'admin' && (
        <Button size="compact-xs" variant="default" component={Link} to={`/projects/${project.id}`}>
          Members
        </Button>
      )}
      <Button
        size="compact-xs"
        variant="default"
        component="a"
        href={at(`/api/projects/${project.id}/export`)}
        download
        aria-label={`Export ${project.name}`}
      >
        Export
      </Button>
      {project.role !== 'viewer' && (
        <FileButton accept=".tar,application/x-tar" onChange={(file) => file && take.mutate(file)}>
          {(props) => (
            <Button
              {...props}
              size="compact-xs"
              variant="default"
              loading={take.isPending}
              aria-label={`Import into ${project.name}`}
            >
              Import
            </Button>
          )}
        </FileButton>
      )}
    </Group>
  )
}

const KINDS = [
  ['run', 'run'],
  ['policy', 'upload'],
  ['recording', 'recording'],
  ['evaluation', 'evaluation'],
  ['arena', 'arena'],
] as const
const OUTCOMES = [
  ['imported', 'imported'],
  ['there', 'there already'],
  ['refused', 'refused'],
] as const

/** "3 runs imported, 1 upload there already", and why what was refused was. */
function importNews({ runs, others }: ProjectImport) {
  const things = [...runs.map((run) => ({ ...run, kind: 'run' as const })), ...others]
  const counts = OUTCOMES.flatMap(([wanted, word]) =>
    KINDS.map(([of, name]) => ({
      number: things.filter(({ kind, outcome }) => kind === of && outcome === wanted).length,
      name,
    }))
      .filter(({ number }) => number > 0)
      .map(({ number, name }) => `${plural(number, name)} ${word}`),
  )
  const refused = things.find(({ outcome }) => outcome === 'refused')
  return {
    title: refused ? 'Not all could be imported' : 'Imported',
    message: `${counts.join(', ') || 'There was nothing in it'}.${refused?.why ? ` ${refused.why}` : ''}`,
    ...(refused ? { color: 'red' } : {}),
  }
}
