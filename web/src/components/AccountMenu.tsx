/** Who is signed in, and where they may go; nothing where there are no accounts. */
import { Button, Menu } from '@mantine/core'
import { useQueryClient } from '@tanstack/react-query'
import { Link } from 'react-router'
import { useAccount } from '../api/account'
import { $api } from '../api/client'

export function AccountMenu() {
  const client = useQueryClient()
  const { data: account } = useAccount()
  const signOut = $api.useMutation('post', '/api/sign-out', { onSuccess: () => client.resetQueries() })
  if (!account?.people) return null
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
      </Menu.Dropdown>
    </Menu>
  )
}
