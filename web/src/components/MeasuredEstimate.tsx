/** Measured numbers: value, 95 % interval, what it is over, the seeds themselves, and what so few leave open. */
import { VisuallyHidden } from '@mantine/core'
import type { Estimate } from '../api/types'
import { count, percent, percentRange, plural, significant } from '../lib/format'
import { Hint } from './Hint'
import classes from './ui.module.css'

interface SuccessEstimateProps {
  estimate: Estimate | null
  /** Says in full what stands behind the number; otherwise its tooltip does. */
  detail?: boolean
}

/** "98.4 %  97.1–99.4 %", and below: "N = 5 seeds, none failed: up to 45 % may". */
export function SuccessEstimate({ estimate, detail = false }: SuccessEstimateProps) {
  if (!estimate) return <span className={classes.quiet}>–</span>
  const { value, low, high, unit } = estimate
  const behind = behindOf(estimate, percent)
  const overSeeds = unit === 'seeds'
  const figure = (
    <span className={`${classes.number} ${classes.estimate}`}>
      <strong>{percent(value)}</strong>
      <span className={classes.quiet}>{percentRange(low, high)}</span>
      {detail ? (
        <span className={classes.open}>{behind}</span>
      ) : (
        <>
          <span className={overSeeds ? classes.open : classes.quiet}>{shortOf(estimate)}</span>
          <VisuallyHidden>{behind}</VisuallyHidden>
        </>
      )}
    </span>
  )
  if (detail) return figure
  return (
    <Hint label={`95 % interval ${percentRange(low, high)}. ${behind}`} multiline maw={360}>
      {figure}
    </Hint>
  )
}

interface FigureEstimateProps {
  estimate: Estimate | null
  format?: (value: number) => string
  range?: (low: number, high: number) => string
}

const three = (value: number) => significant(value, 3)

/** A number with its interval, and every seed below it. */
export function FigureEstimate({
  estimate,
  format = three,
  range = (low, high) => `${three(low)}–${three(high)}`,
}: FigureEstimateProps) {
  if (!estimate) return <span className={classes.quiet}>–</span>
  const { value, low, high, unit, per_seed, failed } = estimate
  return (
    <span className={classes.number}>
      <strong>{format(value)}</strong>
      <span className={classes.quiet}>
        {'  '}
        {range(low, high)}
      </span>
      <span className={classes.behind}>
        {unit === 'seeds' ? `Seeds: ${per_seed.map(format).join(', ')}` : 'Of one seed, over its episodes'}
      </span>
      {failed && <span className={classes.behind}>{failed.sentence}</span>}
    </span>
  )
}

/** "N = 5 seeds, none failed: up to 45 % may"; of one policy: "N = 200, one seed"; of a baseline: "N = 200". */
function shortOf({ unit, seeds, episodes, failed }: Estimate): string {
  if (unit === 'episodes') return `N = ${count(episodes)}${failed ? ', one seed' : ''}`
  const n = `N = ${plural(seeds, 'seed')}`
  if (!failed || failed.told === false) return n
  if (failed.failed === seeds) return `${n}, all failed`
  return `${n}, ${failed.failed || 'none'} failed: up to ${Math.round(failed.at_most * 100)} % may`
}

/** "Over 5 seeds, 1000 episodes: 97 %, 99 %, …. None of 5 seeds failed: up to 45 % may (one-sided 95 %)." */
function behindOf(
  { unit, seeds, episodes, per_seed, failed }: Estimate,
  format: (value: number) => string,
): string {
  const over =
    unit === 'seeds'
      ? `Over ${plural(seeds, 'seed')}, ${plural(episodes, 'episode')}: ${per_seed.map(format).join(', ')}.`
      : `Over the ${plural(episodes, 'episode')} of one policy.`
  return failed ? `${over} ${failed.sentence}` : over
}
