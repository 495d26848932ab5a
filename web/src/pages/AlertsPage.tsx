/** Alerts: of what one wants to be told and how, and what was told. */
import { Button, Stack, Text } from '@mantine/core'
import { useState } from 'react'
import { RuleForm } from '../alerts/RuleForm'
import { RuleTable } from '../alerts/RuleTable'
import { SaidTable } from '../alerts/SaidTable'
import { IconBell } from '../components/icons'
import { Page, Panel } from '../components/ui'
import { HEADS } from '../heads'
import { useTitle } from '../lib/hooks'

export function AlertsPage() {
  useTitle(HEADS.AlertsPage.title)
  return (
    <Page {...HEADS.AlertsPage} actions={<Permission />}>
      <Stack gap="md">
        <Panel title="New rule">
          <RuleForm />
        </Panel>
        <Panel title="Rules" flush>
          <RuleTable />
        </Panel>
        <Panel title="What was told" flush>
          <SaidTable />
        </Panel>
      </Stack>
    </Page>
  )
}

/** Browsers ask for leave after a click only. */
function Permission() {
  const possible = 'Notification' in window && window.isSecureContext
  const [permission, setPermission] = useState(possible ? Notification.permission : 'denied')
  if (!possible) return null
  if (permission === 'default') {
    return (
      <Button
        variant="default"
        leftSection={<IconBell size={16} />}
        onClick={() => void Notification.requestPermission().then(setPermission)}
      >
        Notify me outside of this page
      </Button>
    )
  }
  return (
    <Text size="sm" c="dimmed">
      {permission === 'granted'
        ? 'This browser notifies you, while a page of Mapless is open.'
        : 'This browser does not let Mapless notify you; pages that are open show alerts.'}
    </Text>
  )
}
