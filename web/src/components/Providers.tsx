/** Theme and notifications, for the pages and for their tests alike; `still` leaves out all motion. */
import { MantineProvider } from '@mantine/core'
import { notificationsStore } from '@mantine/notifications'
import { type ReactNode, useEffect, useSyncExternalStore } from 'react'
import { lazily } from '../lib/lazily'
import { theme } from '../theme'

const corner = () => import('./Notifications')
const Notifications = lazily(async () => (await corner()).Notifications)
/** The page comes first. Fetched before it is needed: what there is to say may be that the server is gone. */
const AFTER_MS = 1_500

export function Providers({ children, still = false }: { children: ReactNode; still?: boolean }) {
  const notified = useSyncExternalStore(notificationsStore.subscribe, anyNotified)
  useEffect(() => {
    const timer = setTimeout(corner, AFTER_MS)
    return () => clearTimeout(timer)
  }, [])
  return (
    <MantineProvider
      theme={theme}
      // They stand in the style sheet (plugins/mantineStyles).
      withCssVariables={false}
      defaultColorScheme="auto"
      env={still ? 'test' : 'default'}
    >
      {notified && <Notifications />}
      {children}
    </MantineProvider>
  )
}

function anyNotified(): boolean {
  const { notifications, queue } = notificationsStore.getState()
  return notifications.length + queue.length > 0
}
