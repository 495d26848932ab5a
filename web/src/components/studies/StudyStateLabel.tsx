/** How a study or a trial stands, in the colours of runs. */
import type { CSSProperties } from 'react'
import type { ExperimentState } from '../../api/types'
import { STATES } from '../states'
import ui from '../ui.module.css'

export function StudyStateLabel({ as, label }: { as: ExperimentState; label: string }) {
  return (
    <span className={ui.state} data-state={as} style={{ '--state-color': STATES[as].color } as CSSProperties}>
      <span className={ui.dot} />
      {label}
    </span>
  )
}
