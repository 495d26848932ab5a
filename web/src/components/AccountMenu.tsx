/** Who is signed in, and where they may go. */
import { Button, Menu } from '@mantine/core'
import { notifications } from '@mantine/notifications'
import { useQueryClient } from '@tanstack/react-query'
import { Link } from 'react-router'
import type { useAccount } from '../api/account'
import { $api } from '../api/client'
import { refusalOf } from '../api/errors'
import { useSignInOptions } from './people/ProviderButton'

export function AccountMenu({ account }: { account: NonNullable<ReturnType<typeof useAccount>['data']> }) {
  const client = useQueryClient()
  const signOut = $api.useMutation('post', '/api/sign-out', { onSuccess: () => client.resetQueries() })
  return (
    <Menu position="bottom-end">
      <Menu.Target>
        <Button
          size="compact-sm"
          variant="subtle"
          color="gray"
          maw={140}
          aria-label={`Account of ${account.name}`}
        >
          {account.name}
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        {account.kind === 'person' && (
          <Menu.Item component={Link} to="/account">
            My account
          </Menu.Item>
        )}
        <Menu.Item component={Link} to="/projects">
          Projects
        </Menu.Item>
        {account.administrates && (
          <>
            <Menu.Item component={Link} to="/people">
              People and workers
            </Menu.Item>
            <Menu.Item component={Link} to="/audit">
              What was done
            </Menu.Item>
          </>
        )}
        <Menu.Divider />
        <Menu.Item onClick={() => signOut.mutate({})}>Sign out</Menu.Item>
        {account.connected && <SignOutOfProvider />}
      </Menu.Dropdown>
    </Menu>
  )
}

/** Its address is asked for while somebody is signed in, and followed once nobody is. */
function SignOutOfProvider() {
  const { data: options } = useSignInOptions()
  const signOut = $api.useMutation('post', '/api/sign-out')
  const leave = $api.useMutation('get', '/api/sign-in/provider/end', {
    onSuccess: ({ url }) => signOut.mutate({}, { onSuccess: () => window.location.assign(url) }),
    onError: (error: unknown) =>
      notifications.show({
        color: 'red',
        title: `Could not sign out of ${options?.provider}`,
        message: refusalOf(error),
      }),
  })
  if (!options?.provider) return null
  return <Menu.Item onClick={() => leave.mutate({})}>Sign out of {options.provider}, too</Menu.Item>
}
