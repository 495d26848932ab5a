/** An address that leads nowhere, and a page that broke. */
import { Button, Code } from '@mantine/core'
import { Link, useRouteError } from 'react-router'
import { messageOf } from '../api/errors'
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

/** What a page becomes when its code throws: the reason, and a way on. */
export function BrokenPage() {
  useTitle('Something broke')
  const error = useRouteError()
  return (
    <Message
      alone
      title="This page broke"
      role="alert"
      actions={
        <Button variant="default" onClick={() => window.location.reload()}>
          Reload
        </Button>
      }
    >
      Trainings are not affected. <Code>{messageOf(error)}</Code>
    </Message>
  )
}
