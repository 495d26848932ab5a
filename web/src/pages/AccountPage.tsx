/** One's own account: password, browsers that are signed in, tokens for programs. */
import {
  Badge,
  Button,
  Group,
  NumberInput,
  PasswordInput,
  Select,
  Stack,
  Table,
  Text,
  TextInput,
} from '@mantine/core'
import { useState } from 'react'
import { useAccount } from '../api/account'
import { $api } from '../api/client'
import { messageOf } from '../api/errors'
import { ProviderButton, useSignInOptions } from '../components/people/ProviderButton'
import { Rows } from '../components/people/Rows'
import { Secret } from '../components/people/Secret'
import { useChange } from '../components/people/useChange'
import { Message, Page, Panel } from '../components/ui'
import { dateTime } from '../lib/format'
import { useTitle } from '../lib/hooks'

const SHORTEST = 10
const SCOPES = [
  { value: 'read', label: 'read: looks' },
  { value: 'launch', label: 'launch: launches, stops, deletes' },
  { value: 'admin', label: 'admin: all that you may' },
]

export function AccountPage() {
  useTitle('My account')
  const { data: account } = useAccount()
  if (account && account.kind !== 'person') {
    return (
      <Message alone title="This login is no account">
        It is the token that the server printed at its start.
      </Message>
    )
  }
  return (
    <Page title={account?.name ?? 'My account'}>
      <Stack gap="md">
        {account && <ProviderPanel connected={account.connected} />}
        {account?.has_password && <Password />}
        <Tokens />
        <Sessions />
      </Stack>
    </Page>
  )
}

function ProviderPanel({ connected }: { connected: boolean }) {
  const { data: options } = useSignInOptions()
  if (!options?.provider) return null
  return (
    <Panel title={`Signing in with ${options.provider}`}>
      {connected ? (
        <Text size="sm">Connected: you sign in to this account with {options.provider}.</Text>
      ) : (
        <Stack gap="sm" align="start">
          <Text size="sm" c="dimmed">
            Connect your identity there, and it signs you in to this account from now on.
          </Text>
          <ProviderButton refused={options.refused ?? null} connect back="/account">
            Connect
          </ProviderButton>
        </Stack>
      )}
    </Panel>
  )
}

function Password() {
  const [old, setOld] = useState('')
  const [next, setNext] = useState('')
  const change = $api.useMutation('put', '/api/account/password', {
    onSuccess: () => {
      setOld('')
      setNext('')
    },
  })
  return (
    <Panel title="Password">
      <Group
        component="form"
        align="end"
        gap="sm"
        onSubmit={(event) => {
          event.preventDefault()
          change.mutate({ body: { old, new: next } })
        }}
      >
        <PasswordInput
          label="Present password"
          autoComplete="current-password"
          w={220}
          value={old}
          onChange={(event) => setOld(event.currentTarget.value)}
        />
        <PasswordInput
          label={`New password, ${SHORTEST} or more characters`}
          autoComplete="new-password"
          w={300}
          value={next}
          onChange={(event) => setNext(event.currentTarget.value)}
        />
        <Button type="submit" loading={change.isPending} disabled={old === '' || next.length < SHORTEST}>
          Change
        </Button>
      </Group>
      <Text size="sm" mt="xs" c={change.isError ? 'red' : 'dimmed'} role="status">
        {change.isError
          ? messageOf(change.error)
          : change.isSuccess
            ? 'Changed. Your other browsers were signed out.'
            : 'A new one signs out your other browsers.'}
      </Text>
    </Panel>
  )
}

function Tokens() {
  const settle = useChange()
  const tokens = $api.useQuery('get', '/api/account/tokens')
  const make = $api.useMutation('post', '/api/account/tokens', settle('make the token'))
  const revoke = $api.useMutation('delete', '/api/account/tokens/{token_id}', settle('revoke the token'))
  const [name, setName] = useState('')
  const [scope, setScope] = useState<'read' | 'launch' | 'admin'>('read')
  const [days, setDays] = useState<number>(90)
  const [made, setMade] = useState<string>()
  return (
    <Panel title="Tokens for programs" flush>
      <Stack gap="sm" px="md" pb="sm">
        <Group
          component="form"
          align="end"
          gap="sm"
          onSubmit={(event) => {
            event.preventDefault()
            make.mutate(
              { body: { name, scope, days, projects: null } },
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
            label="For"
            maxLength={80}
            value={name}
            onChange={(event) => setName(event.currentTarget.value)}
          />
          <Select
            label="Scope"
            allowDeselect={false}
            w={260}
            data={SCOPES}
            value={scope}
            onChange={(value) => setScope((value ?? 'read') as typeof scope)}
          />
          <NumberInput
            label="Days"
            min={1}
            max={3650}
            w={100}
            value={days}
            onChange={(value) => setDays(typeof value === 'number' ? value : 90)}
          />
          <Button type="submit" loading={make.isPending} disabled={name.trim() === ''}>
            Make a token
          </Button>
        </Group>
        {made && <Secret title="Your new token" text={made} onClose={() => setMade(undefined)} />}
      </Stack>
      <Rows
        what="Tokens"
        head={['For', 'Scope', 'Last used', 'Ends', '']}
        query={tokens}
        empty="No token yet."
      >
        {tokens.data?.map((token) => (
          <Table.Tr key={token.id} data-testid="token">
            <Table.Td>{token.name}</Table.Td>
            <Table.Td>{token.scope}</Table.Td>
            <Table.Td>{token.seen_at === null ? 'never' : dateTime(token.seen_at)}</Table.Td>
            <Table.Td>{token.expires_at === null ? 'never' : dateTime(token.expires_at)}</Table.Td>
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

function Sessions() {
  const settle = useChange()
  const sessions = $api.useQuery('get', '/api/account/sessions')
  const end = $api.useMutation('delete', '/api/account/sessions/{session_id}', settle('sign the browser out'))
  return (
    <Panel title="Signed in" flush>
      <Rows
        what="Browsers"
        head={['Browser', 'Address', 'Since', 'Last seen', '']}
        query={sessions}
        empty="No browser is signed in."
      >
        {sessions.data?.map((session) => (
          <Table.Tr key={session.id} data-testid="session">
            <Table.Td maw={320}>
              <Text size="sm" lineClamp={1} title={session.browser}>
                {session.browser || 'unknown'}
              </Text>
            </Table.Td>
            <Table.Td>{session.address}</Table.Td>
            <Table.Td>{dateTime(session.created_at)}</Table.Td>
            <Table.Td>{dateTime(session.seen_at)}</Table.Td>
            <Table.Td ta="right">
              {session.current ? (
                <Badge variant="light">This one</Badge>
              ) : (
                <Button
                  size="compact-xs"
                  variant="default"
                  onClick={() => end.mutate({ params: { path: { session_id: session.id } } })}
                >
                  Sign out
                </Button>
              )}
            </Table.Td>
          </Table.Tr>
        ))}
      </Rows>
    </Panel>
  )
}
