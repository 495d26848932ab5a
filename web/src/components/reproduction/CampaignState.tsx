/** How a campaign stands: progress and time left while it goes on, and what went wrong. */
import { Anchor, Group, Text } from '@mantine/core'
import { Link } from 'react-router'
import type { Campaign, CampaignRow } from '../../api/types'
import { dateTime, duration, percent, plural } from '../../lib/format'
import { isActive } from '../states'
import { Notice, Panel, ProgressBar, StateLabel } from '../ui'
import ui from '../ui.module.css'

export function CampaignState({ campaign, rows }: { campaign: Campaign; rows: readonly CampaignRow[] }) {
  const runs = rows.flatMap((row) => row.runs.map((run) => ({ row, run })))
  const done = runs.filter(({ run }) => run.measured !== null).length
  const failed = runs.filter(({ run }) => run.state === 'failed')
  const active = isActive(campaign.state)
  return (
    <>
      <Panel data-testid="campaign">
        <Group justify="space-between" gap="4px 20px">
          <Group gap="4px 16px">
            <Text size="sm" component="div">
              <StateLabel state={campaign.state} states={runs.map(({ run }) => run.state)} />
            </Text>
            <Text size="sm" className={ui.number}>
              {done} of {plural(runs.length, 'training')} done
            </Text>
            <Text size="sm" c="dimmed">
              {plural(campaign.seeds, 'seed')}, launched {dateTime(campaign.created_at)}
            </Text>
          </Group>
          {active && (
            <Text size="sm" className={ui.number}>
              {percent(campaign.progress)}
              <span className={ui.quiet}>
                {campaign.seconds_left === null
                  ? ', waits for a worker'
                  : `, about ${duration(campaign.seconds_left)} left`}
              </span>
            </Text>
          )}
        </Group>
        {active && (
          <div style={{ marginTop: 10 }}>
            <ProgressBar value={campaign.progress} state={campaign.state} label="Progress of the campaign" />
          </div>
        )}
      </Panel>
      {campaign.effort < 1 && (
        <Notice title="A trial" data-testid="trial">
          Trained with {percent(campaign.effort)} of the steps: it shows that everything works, and its
          figures say nothing of the paper's.
        </Notice>
      )}
      {failed.length > 0 && (
        <Notice title={`${plural(failed.length, 'training')} failed`} bad data-testid="failed">
          Without them the figures below are those of the other seeds. Go on to try them again.
          <ul style={{ margin: '4px 0 0', paddingLeft: 18 }}>
            {failed.map(({ row, run }) => (
              <li key={run.id}>
                <Anchor component={Link} to={`/runs/${run.id}`} inherit>
                  {row.method}, seed {run.seed}
                </Anchor>
                {run.error && `: ${run.error.split('\n')[0]}`}
              </li>
            ))}
          </ul>
        </Notice>
      )}
    </>
  )
}
