/** Where notifications appear. */
import '@mantine/notifications/styles.layer.css'
import { Notifications as Corner } from '@mantine/notifications'

export function Notifications() {
  return <Corner position="bottom-right" limit={3} />
}
