/** What waits, in which order and for what; who works on what. */
import { Stack } from '@mantine/core'
import { useAccount } from '../api/account'
import { Page } from '../components/ui'
import { HEADS } from '../heads'
import { useTitle } from '../lib/hooks'
import { Jobs } from '../queue/Jobs'
import { Waiting } from '../queue/Waiting'
import { Workers } from '../queue/Workers'

export function QueuePage() {
  useTitle(HEADS.QueuePage.title)
  const administrates = useAccount().data?.administrates ?? false
  return (
    <Page {...HEADS.QueuePage}>
      <Stack gap="md">
        <Waiting />
        <Workers />
        {administrates && <Jobs />}
      </Stack>
    </Page>
  )
}
