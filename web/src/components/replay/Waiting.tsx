/** What one waits for before a replay: evaluations that are driven once more, then the picture. */
import { Progress } from '@mantine/core'
import type { ReplayProgress } from '../../api/types'
import classes from './Replay.module.css'

export function Waiting({ progress }: { progress: ReplayProgress | undefined }) {
  return (
    <div className={classes.waiting} role="status">
      <Progress value={100 * (progress?.share ?? 0)} w={220} aria-label="Driven again" />
      {(progress?.policies ?? 1) > 1
        ? `Driving ${progress?.policies} evaluations once more: ${progress?.ready} are there.`
        : 'Driving the evaluation once more. The first replay of a policy takes a few seconds, all others come at once.'}
    </div>
  )
}

/** A worker draws the picture; `share` is how much of it, where that is known. */
export function Drawing({ share }: { share: number | undefined }) {
  return (
    <div className={classes.waiting} role="status">
      {share !== undefined && <Progress value={100 * share} w={220} aria-label="Drawn" />}
      Drawing the picture.
    </div>
  )
}
