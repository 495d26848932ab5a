/** An address that leads nowhere. */
import { Button } from '@mantine/core'
import { Link } from 'react-router'
import { Page } from '../components/ui'
import { HEADS } from '../heads'
import { useTitle } from '../lib/hooks'

export function NotFoundPage() {
  useTitle(HEADS.NotFoundPage.title)
  return (
    <Page {...HEADS.NotFoundPage}>
      <Button component={Link} to="/" variant="default">
        All trainings
      </Button>
    </Page>
  )
}
