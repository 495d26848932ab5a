/** Every seed's success on a line from 0 to 100 %, the paper's as a mark; seeds that are not done beside it in words. */
import { Anchor } from '@mantine/core'
import { Link } from 'react-router'
import type { CampaignRow, CampaignRun } from '../../api/types'
import { percent } from '../../lib/format'
import { Hint } from '../Hint'
import { STATES } from '../states'
import classes from './reproduction.module.css'

export function SeedStrip({ row }: { row: CampaignRow }) {
  const waiting = row.runs.filter((run) => run.measured === null)
  return (
    <div data-testid="seeds">
      <div className={classes.strip}>
        <Hint label={`The paper: ${percent(row.paper.success)}`}>
          <span className={classes.mark} style={{ left: percentOf(row.paper.success) }} />
        </Hint>
        {row.runs.map(
          (run) =>
            run.measured && (
              <Hint key={run.id} label={`Seed ${run.seed}: ${percent(run.measured.success)}`}>
                <Link
                  to={`/runs/${run.id}`}
                  className={classes.seed}
                  aria-label={`Seed ${run.seed}: ${percent(run.measured.success)} success`}
                  style={{ left: percentOf(run.measured.success) }}
                />
              </Hint>
            ),
        )}
      </div>
      <div className={classes.scale} aria-hidden>
        <span>0</span>
        <span>100 %</span>
      </div>
      {waiting.length > 0 && (
        <div className={classes.waiting}>
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

const percentOf = (share: number) => `${share * 100}%`

function stateOf(run: CampaignRun): string {
  const { label } = STATES[run.state]
  return run.state === 'running' ? `${label}, ${percent(run.progress)}` : label
}
