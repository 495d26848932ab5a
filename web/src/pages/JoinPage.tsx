/** Where an invitation's link leads: join, or set a new password. The code stays behind the #, which no server ever sees. */
import { Button, Divider, PasswordInput, Text, TextInput, Title } from '@mantine/core'
import { useQueryClient } from '@tanstack/react-query'
import { useState } from 'react'
import { useLocation, useNavigate } from 'react-router'
import { useAccount } from '../api/account'
import { $api } from '../api/client'
import { messageOf } from '../api/errors'
import { ProviderButton, useSignInOptions } from '../components/people/ProviderButton'
import { Message } from '../components/ui'
import { dateTime } from '../lib/format'
import { useTitle } from '../lib/hooks'
import { LoginFrame } from './LoginPage'

const SHORTEST = 10

export function JoinPage() {
  useTitle('Join')
  const client = useQueryClient()
  const navigate = useNavigate()
  const code = useLocation().hash.slice(1)
  const account = useAccount()
  const options = useSignInOptions()
  const [name, setName] = useState('')
  const [password, setPassword] = useState('')
  const invitation = $api.useQuery(
    'post',
    '/api/invitations/look',
    { body: { code: code || '-' } },
    { retry: false, staleTime: Number.POSITIVE_INFINITY, refetchOnWindowFocus: false },
  )
  const accept = $api.useMutation('post', '/api/invitations/accept', {
    onSuccess: async () => {
      await navigate('/')
      await client.resetQueries()
    },
  })
  if (invitation.isPending) return null
  if (invitation.isError) {
    return (
      <Message alone title="This link opens nothing" role="alert">
        {messageOf(invitation.error)}
      </Message>
    )
  }
  const { purpose, project, role, admin, invited_by, expires_at } = invitation.data
  const resets = purpose === 'password'
  const known = !resets && account.data?.kind === 'person'
  const rights = [...(project ? [`${role} in ${project}`] : []), ...(admin ? ['administrator'] : [])].join(
    ', ',
  )
  const ready = known || (password.length >= SHORTEST && (resets || name.trim() !== ''))
  return (
    <LoginFrame
      onSubmit={() =>
        accept.mutate({
          body: {
            code,
            name: known || resets ? null : name.trim(),
            password: known ? null : password,
          },
        })
      }
    >
      <Title order={1}>{resets ? `New password for ${invitation.data.name}` : 'Join Mapless'}</Title>
      <Text size="sm" c="dimmed">
        {resets ? 'Set' : `${invited_by} invited you${rights ? ` as ${rights}` : ''}. Accept`} by{' '}
        {dateTime(expires_at)}.{known && ` You are signed in as ${account.data?.name}.`}
      </Text>
      {!resets && !known && (
        <TextInput
          label="Name"
          description="Letters, digits and . _ @ + -"
          autoComplete="username"
          value={name}
          onChange={(event) => setName(event.currentTarget.value)}
          data-autofocus
          autoFocus
        />
      )}
      {!known && (
        <PasswordInput
          label="Password"
          description={`${SHORTEST} characters or more`}
          autoComplete="new-password"
          value={password}
          onChange={(event) => setPassword(event.currentTarget.value)}
        />
      )}
      {accept.error && (
        <Text size="sm" c="red" role="alert">
          {messageOf(accept.error)}
        </Text>
      )}
      <Button type="submit" loading={accept.isPending} disabled={!ready}>
        {resets ? 'Set the password' : 'Join'}
      </Button>
      {!resets && !known && options.data?.provider && (
        <>
          <Divider label="or" />
          <ProviderButton refused={null} invitation={code} back="/">
            Join with {options.data.provider}
          </ProviderButton>
        </>
      )}
    </LoginFrame>
  )
}
