/** Asks for the token that the server printed when it started. */
import { Button, Code, Paper, PasswordInput, Stack, Text, Title } from '@mantine/core'
import { useQueryClient } from '@tanstack/react-query'
import { useState } from 'react'
import { $api } from '../api/client'
import { isUnauthorized, messageOf } from '../api/errors'
import { useTitle } from '../lib/hooks'

export function LoginPage() {
  useTitle('Log in')
  const client = useQueryClient()
  const [token, setToken] = useState('')
  const login = $api.useMutation('post', '/api/login', { onSuccess: () => client.resetQueries() })
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
        login.mutate({ body: { token: token.trim() } })
      }}
    >
      <Stack gap="md">
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
      </Stack>
    </Paper>
  )
}
