/** Theme and notifications, for the pages and for their tests alike; `still` leaves out all motion. */
import { MantineProvider } from '@mantine/core'
import { Notifications } from '@mantine/notifications'
import type { ReactNode } from 'react'
import { cssVariables, theme } from '../theme'

export function Providers({ children, still = false }: { children: ReactNode; still?: boolean }) {
  return (
    <MantineProvider
      theme={theme}
      cssVariablesResolver={cssVariables}
      defaultColorScheme="auto"
      env={still ? 'test' : 'default'}
    >
      <Notifications position="bottom-right" limit={3} />
      {children}
    </MantineProvider>
  )
}
