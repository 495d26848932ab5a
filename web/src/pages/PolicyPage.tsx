/** One of the policies that ship: its robots live, how it did and against what, every episode, and how it was made. */
import { Group, Skeleton, Stack } from '@mantine/core'
import { useParams } from 'react-router'
import { $api } from '../api/client'
import type { ShippedPolicy } from '../api/types'
import { Configuration } from '../components/Configuration'
import { PolicyLiveView } from '../components/LiveView'
import { PolicyActions } from '../components/PolicyActions'
import { PolicyEpisodes } from '../components/PolicyEpisodes'
import { PolicyResults } from '../components/PolicyResults'
import { Page, Panel, QueryError, Within } from '../components/ui'
import { earlyHead } from '../lib/early'
import { inShort, summaryOf } from '../lib/experiments'
import { count } from '../lib/format'
import { useReplayInAddress, useTitle } from '../lib/hooks'
import classes from './PolicyPage.module.css'

export function PolicyPage() {
  const { name = '' } = useParams()
  const { data, error, refetch } = $api.useQuery(
    'get',
    '/api/policies/{name}',
    { params: { path: { name } } },
    { staleTime: Number.POSITIVE_INFINITY },
  )
  useTitle(data?.title ?? 'Policy')
  if (data) return <LoadedPolicy policy={data} />
  return (
    <Page
      title={error ? 'Policy' : (earlyHead().title ?? <Skeleton height={24} width={240} />)}
      about={error ? undefined : earlyHead().about}
      above={<Within page="PolicyPage" />}
    >
      <Panel>
        {error ? <QueryError error={error} what="policy" retry={refetch} /> : <Skeleton height={460} />}
      </Panel>
    </Page>
  )
}

function LoadedPolicy({ policy }: { policy: ShippedPolicy }) {
  const [episode] = useReplayInAddress()
  return (
    <Page
      title={policy.title}
      above={<Within page="PolicyPage" />}
      about={policy.description}
      actions={
        <Group gap="xs">
          <PolicyActions policy={policy} />
        </Group>
      }
    >
      <Stack gap="md">
        <div className={classes.stage}>
          <Panel flush>
            <PolicyLiveView name={policy.name} covered={episode !== null} />
          </Panel>
          <Panel title="How it was made">
            <dl className={classes.facts}>
              <div>
                <dt>Training</dt>
                <dd>
                  {summaryOf(inShort(policy.training))}, seed {policy.seed}
                </dd>
              </div>
              <div>
                <dt>Checkpoint</dt>
                <dd>
                  Step {count(policy.step)} of {count(policy.training.steps)}, the best on{' '}
                  {policy.results[0]?.suite}
                </dd>
              </div>
              <div>
                <dt>Command, in a checkout</dt>
                <dd>
                  <code className={classes.command}>{policy.command}</code>
                </dd>
              </div>
            </dl>
            <Configuration training={policy.training} />
          </Panel>
        </div>
        <Panel title="Against what needs no training" flush>
          <PolicyResults results={policy.results} />
        </Panel>
        <PolicyEpisodes policy={policy} />
      </Stack>
    </Page>
  )
}
