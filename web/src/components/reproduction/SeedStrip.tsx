/** Every seed's success on a line from 0 to 100 %, the paper's as a mark; below it what leads to each seed, and those that are not done. */
import { Anchor } from '@mantine/core'
import { Link } from 'react-router'
import type { CampaignRow, CampaignRun } from '../../api/types'
import { percent, plural } from '../../lib/format'
import { Hint } from '../Hint'
import { STATES } from '../states'
import classes from './reproduction.module.css'

/** Seeds nearer than this stand above one another: a dot's width on a strip of 200 pixels. */
const APART = 0.05
/** Pixels between two lanes, and the most that all of them may take. */
const LANE = 8
const MOST = 40

export function SeedStrip({ row }: { row: CampaignRow }) {
  const done = row.runs.filter((run) => run.measured !== null)
  const waiting = row.runs.filter((run) => run.measured === null)
  const lanes = lanesOf(row.runs.map((run) => run.measured?.success ?? null))
  const last = Math.max(0, ...lanes)
  const lane = Math.min(LANE, MOST / Math.max(1, last))
  return (
    <div data-testid="seeds">
      <div aria-hidden>
        <div className={classes.strip} style={{ '--above': `${last * lane}px` } as React.CSSProperties}>
          <Hint label={`The paper: ${percent(row.paper.success)}`}>
            <span className={classes.mark} style={{ left: percentOf(row.paper.success) }} />
          </Hint>
          {row.runs.map(
            (run, index) =>
              run.measured && (
                <Hint key={run.id} label={`Seed ${run.seed}: ${percent(run.measured.success)}`}>
                  <span
                    className={classes.seed}
                    style={{
                      left: percentOf(run.measured.success),
                      marginBottom: (lanes[index] ?? 0) * lane,
                    }}
                  />
                </Hint>
              ),
          )}
        </div>
        <div className={classes.scale}>
          <span>0</span>
          <span>100 %</span>
        </div>
      </div>
      {/* What is pressed is as large as a finger needs it; the dots of a strip can't be. */}
      {done.length > 0 && (
        <details className={classes.each}>
          <summary>{plural(done.length, 'seed')}</summary>
          <div className={classes.links}>
            {done.map((run) => (
              <Anchor key={run.id} component={Link} to={`/runs/${run.id}`} inherit>
                Seed {run.seed}: {percent(run.measured?.success ?? 0)}
              </Anchor>
            ))}
          </div>
        </details>
      )}
      {waiting.length > 0 && (
        <div className={classes.links}>
          {waiting.map((run) => (
            <Hint key={run.id} label={`Seed ${run.seed}: ${stateOf(run)}`}>
              <Anchor
                component={Link}
                to={`/runs/${run.id}`}
                inherit
                aria-label={`Seed ${run.seed}: ${stateOf(run)}`}
                data-state={run.state}
                style={{ '--state-color': STATES[run.state].color } as React.CSSProperties}
              >
                {run.state === 'running' ? `${percent(run.progress)} trained` : run.seed}
              </Anchor>
            </Hint>
          ))}
        </div>
      )}
    </div>
  )
}

/** The lowest lane in which each has room beside those before it; of what is not measured yet, lane 0. */
export function lanesOf(shares: readonly (number | null)[]): number[] {
  const taken: number[][] = []
  return shares.map((share) => {
    if (share === null) return 0
    const free = taken.findIndex((lane) => lane.every((other) => Math.abs(other - share) >= APART))
    const lane = free === -1 ? taken.push([]) - 1 : free
    taken[lane]?.push(share)
    return lane
  })
}

const percentOf = (share: number) => `${share * 100}%`

function stateOf(run: CampaignRun): string {
  const { label } = STATES[run.state]
  return run.state === 'running' ? `${label}, ${percent(run.progress)}` : label
}
