/** Where a playground is opened: which policy drives in it, and where. */
import { OpenForm } from '../components/playground/OpenForm'
import { Page, Panel } from '../components/ui'
import { HEADS } from '../heads'
import { useTitle } from '../lib/hooks'

export function PlayPage() {
  useTitle(HEADS.PlayPage.title)
  return (
    <Page {...HEADS.PlayPage}>
      <Panel title="Which policy, and where?">
        <OpenForm />
      </Panel>
    </Page>
  )
}
