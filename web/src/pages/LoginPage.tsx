/** Asks who it is: name and password where there are accounts, else the token that the server printed at its start. */
import {
  Anchor,
  Button,
  Code,
  Divider,
  Paper,
  PasswordInput,
  Stack,
  Text,
  TextInput,
  Title,
} from '@mantine/core'
import { useQueryClient } from '@tanstack/react-query'
import { type ReactNode, useState } from 'react'
import { $api } from '../api/client'
import { isUnauthorized, messageOf } from '../api/errors'
import { ProviderButton, useSignInOptions } from '../components/people/ProviderButton'
import { useTitle } from '../lib/hooks'

export function LoginPage() {
  useTitle('Log in')
  const options = useSignInOptions()
  const [byToken, setByToken] = useState(false)
  if (options.isPending) return null
  const { people, provider, refused } = options.data ?? {}
  if ((!people && !provider) || byToken) return <TokenForm />
  return (
    <AccountForm
      passwords={people ?? false}
      provider={provider ?? null}
      refused={refused ?? null}
      onToken={() => setByToken(true)}
    />
  )
}

export function LoginFrame({ onSubmit, children }: { onSubmit: () => void; children: ReactNode }) {
  return (
    <Paper
      component="form"
      withBorder
      w="min(420px, 100% - 28px)"
      mx="auto"
      mt="12vh"
      p="xl"
      radius="md"
      onSubmit={(event) => {
        event.preventDefault()
        onSubmit()
      }}
    >
      <Stack gap="md">{children}</Stack>
    </Paper>
  )
}

function AccountForm({
  passwords,
  provider,
  refused,
  onToken,
}: {
  passwords: boolean
  provider: string | null
  refused: string | null
  onToken: () => void
}) {
  const client = useQueryClient()
  const [name, setName] = useState('')
  const [password, setPassword] = useState('')
  const signIn = $api.useMutation('post', '/api/sign-in', { onSuccess: () => client.resetQueries() })
  return (
    <LoginFrame onSubmit={() => signIn.mutate({ body: { name: name.trim(), password } })}>
      <Title order={1}>Sign in</Title>
      {provider && <ProviderButton refused={refused}>Sign in with {provider}</ProviderButton>}
      {provider && passwords && <Divider label="or" />}
      {passwords && (
        <>
          <TextInput
            label="Name"
            autoComplete="username"
            value={name}
            onChange={(event) => setName(event.currentTarget.value)}
            data-autofocus
            autoFocus
          />
          <PasswordInput
            label="Password"
            autoComplete="current-password"
            value={password}
            onChange={(event) => setPassword(event.currentTarget.value)}
            error={signIn.error && messageOf(signIn.error)}
          />
          <Button
            type="submit"
            variant={provider ? 'default' : 'filled'}
            loading={signIn.isPending}
            disabled={name.trim() === '' || password === ''}
          >
            Sign in{provider && ' with a password'}
          </Button>
        </>
      )}
      <Text size="sm" c="dimmed">
        No account? Somebody who administrates a project can send you a link. Whoever runs the server can{' '}
        <Anchor component="button" type="button" size="sm" onClick={onToken}>
          use its token
        </Anchor>
        .
      </Text>
    </LoginFrame>
  )
}

function TokenForm() {
  const client = useQueryClient()
  const [token, setToken] = useState('')
  const login = $api.useMutation('post', '/api/login', { onSuccess: () => client.resetQueries() })
  return (
    <LoginFrame onSubmit={() => login.mutate({ body: { token: token.trim() } })}>
      <Title order={1}>Log in</Title>
      <Text size="sm" c="dimmed">
        The server printed an address with a token when it started: open that address, or paste the token
        here. It is also in the file <Code>token</Code> of the server's data directory.
      </Text>
      <PasswordInput
        label="Token"
        autoComplete="current-password"
        value={token}
        onChange={(event) => setToken(event.currentTarget.value)}
        error={
          login.error &&
          (isUnauthorized(login.error) ? 'That is not the token of this server.' : messageOf(login.error))
        }
        data-autofocus
        autoFocus
      />
      <Button type="submit" loading={login.isPending} disabled={token.trim() === ''}>
        Log in
      </Button>
    </LoginFrame>
  )
}
