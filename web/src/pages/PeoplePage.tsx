/** For administrators: everybody with an account, invitations, and the tokens of workers' machines. */
import { Badge, Button, Group, Menu, Stack, Table, Text, TextInput } from '@mantine/core'
import { useState } from 'react'
import { useAccount } from '../api/account'
import { $api } from '../api/client'
import { IconDots } from '../components/icons'
import { Pager } from '../components/Pager'
import { Invitations } from '../components/people/Invitations'
import { InviteForm } from '../components/people/InviteForm'
import { Rows } from '../components/people/Rows'
import { Secret } from '../components/people/Secret'
import { useChange } from '../components/people/useChange'
import { Page, Panel } from '../components/ui'
import { HEADS } from '../heads'
import { at } from '../lib/base'
import { dateTime } from '../lib/format'
import { useTitle } from '../lib/hooks'

const SIZE = 50

export function PeoplePage() {
  useTitle(HEADS.PeoplePage.title)
  const projects = $api.useQuery('get', '/api/projects', { params: { query: { limit: 200 } } })
  return (
    <Page {...HEADS.PeoplePage}>
      <Stack gap="md">
        <People />
        <Panel title="Invite">
          {/* Made anew when the projects are there, one of which it begins with. */}
          <InviteForm key={projects.status} projects={projects.data?.items ?? []} administrators />
        </Panel>
        <Invitations />
        <WorkerTokens />
      </Stack>
    </Page>
  )
}

function People() {
  const settle = useChange()
  const { data: account } = useAccount()
  const [page, setPage] = useState(1)
  const [link, setLink] = useState<{ name: string; href: string }>()
  const people = $api.useQuery('get', '/api/people', {
    params: { query: { limit: SIZE, offset: (page - 1) * SIZE } },
  })
  const change = $api.useMutation('patch', '/api/people/{user_id}', settle('change the account'))
  const reset = $api.useMutation('post', '/api/people/{user_id}/password-link', settle('make the link'))
  return (
    <Panel title="People" flush>
      {link && (
        <Stack px="md" pb="sm">
          <Secret
            title={`By this link ${link.name} sets a new password, within a day`}
            text={link.href}
            onClose={() => setLink(undefined)}
          />
        </Stack>
      )}
      <Rows what="People" head={['Name', 'Projects', 'Last seen', '']} query={people} empty="Nobody yet.">
        {people.data?.items.map((person) => {
          const of = { params: { path: { user_id: person.id } } }
          return (
            <Table.Tr key={person.id} data-testid="person">
              <Table.Td>
                <Group gap="xs">
                  {person.name}
                  {person.admin && <Badge variant="light">administrator</Badge>}
                  {person.disabled && <Badge color="gray">closed</Badge>}
                </Group>
                {person.email && (
                  <Text size="xs" c="dimmed">
                    {person.email}
                  </Text>
                )}
              </Table.Td>
              <Table.Td>
                {person.roles.map(({ project, role }) => `${project} (${role})`).join(', ') || '–'}
              </Table.Td>
              <Table.Td>{person.seen_at === null ? '–' : dateTime(person.seen_at)}</Table.Td>
              <Table.Td ta="right">
                <Menu position="bottom-end">
                  <Menu.Target>
                    <Button
                      size="compact-xs"
                      variant="subtle"
                      color="gray"
                      aria-label={`Actions for ${person.name}`}
                    >
                      <IconDots size={18} stroke={1.6} />
                    </Button>
                  </Menu.Target>
                  <Menu.Dropdown>
                    <Menu.Item
                      onClick={() =>
                        reset.mutate(of, {
                          onSuccess: ({ path }) =>
                            setLink({
                              name: person.name,
                              href: new URL(at(path), window.location.origin).href,
                            }),
                        })
                      }
                    >
                      Link for a new password
                    </Menu.Item>
                    <Menu.Item
                      disabled={person.name === account?.name}
                      onClick={() => change.mutate({ ...of, body: { admin: !person.admin } })}
                    >
                      {person.admin ? 'No longer administrator' : 'Make administrator'}
                    </Menu.Item>
                    <Menu.Item
                      color="red"
                      disabled={person.name === account?.name}
                      onClick={() => change.mutate({ ...of, body: { disabled: !person.disabled } })}
                    >
                      {person.disabled ? 'Open the account again' : 'Close the account'}
                    </Menu.Item>
                  </Menu.Dropdown>
                </Menu>
              </Table.Td>
            </Table.Tr>
          )
        })}
      </Rows>
      <Pager
        page={page}
        size={SIZE}
        total={people.data?.total ?? 0}
        label="Pages of people"
        onChange={setPage}
      />
    </Panel>
  )
}

function WorkerTokens() {
  const settle = useChange()
  const tokens = $api.useQuery('get', '/api/worker-tokens')
  const make = $api.useMutation('post', '/api/worker-tokens', settle('make the token'))
  const revoke = $api.useMutation('delete', '/api/worker-tokens/{token_id}', settle('revoke the token'))
  const [name, setName] = useState('')
  const [made, setMade] = useState<string>()
  return (
    <Panel title="Tokens of workers" flush>
      <Stack gap="sm" px="md" pb="sm">
        <Group
          component="form"
          align="end"
          gap="sm"
          onSubmit={(event) => {
            event.preventDefault()
            make.mutate(
              { body: { name } },
              {
                onSuccess: ({ token }) => {
                  setMade(token)
                  setName('')
                },
              },
            )
          }}
        >
          <TextInput
            label="Machine"
            maxLength={80}
            value={name}
            onChange={(event) => setName(event.currentTarget.value)}
          />
          <Button type="submit" loading={make.isPending} disabled={name.trim() === ''}>
            Make a token
          </Button>
        </Group>
        {made && (
          <Secret
            title="MAPLESS_WORKER_TOKEN of that machine"
            text={made}
            onClose={() => setMade(undefined)}
          />
        )}
      </Stack>
      <Rows
        what="Tokens of workers"
        head={['Machine', 'Made', 'Last used', '']}
        query={tokens}
        empty="All workers use the server's own token."
      >
        {tokens.data?.map((token) => (
          <Table.Tr key={token.id} data-testid="worker-token">
            <Table.Td>{token.name}</Table.Td>
            <Table.Td>{dateTime(token.created_at)}</Table.Td>
            <Table.Td>{token.seen_at === null ? 'never' : dateTime(token.seen_at)}</Table.Td>
            <Table.Td ta="right">
              <Button
                size="compact-xs"
                variant="default"
                onClick={() => revoke.mutate({ params: { path: { token_id: token.id } } })}
              >
                Revoke
              </Button>
            </Table.Td>
          </Table.Tr>
        ))}
      </Rows>
    </Panel>
  )
}
