/** An address that leads nowhere. */
import { Button } from '@mantine/core'
import { Link } from 'react-router'
import { IconCompassOff } from '../components/icons'
import { Message } from '../components/ui'
import { useTitle } from '../lib/hooks'

export function NotFoundPage() {
  useTitle('Not found')
  return (
    <Message
      icon={<IconCompassOff size={40} stroke={1.3} />}
      alone
      title="There is no page here"
      actions={
        <Button component={Link} to="/" variant="default">
          All trainings
        </Button>
      }
    >
      The address may be mistyped, or what it led to has been deleted.
    </Message>
  )
}
