/** The dialog of an episode; its code, and that of its charts, comes when one is looked at. */
import { type ComponentProps, lazy, Suspense } from 'react'

const ReplayDialog = lazy(async () => ({ default: (await import('./ReplayDialog')).ReplayDialog }))

export function Replay(props: ComponentProps<typeof ReplayDialog>) {
  return (
    <Suspense fallback={null}>
      <ReplayDialog {...props} />
    </Suspense>
  )
}
