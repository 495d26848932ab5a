/** One of the policies that ship: its robots live, how it did and against what, every episode, and how it was made. */
import { Anchor, Group, Skeleton, Stack, Text } from '@mantine/core'
import { Link, useParams } from 'react-router'
import { $api } from '../api/client'
import type { ShippedPolicy } from '../api/types'
import { Configuration } from '../components/Configuration'
import { PolicyLiveView } from '../components/LiveView'
import { PolicyActions } from '../components/PolicyActions'
import { PolicyEpisodes } from '../components/PolicyEpisodes'
import { PolicyResults } from '../components/PolicyResults'
import { Page, Panel, QueryError } from '../components/ui'
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
      title={error ? 'Policy' : <Skeleton height={24} width={240} />}
      above={<Text size="xs">&nbsp;</Text>}
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
      above={
        <Anchor component={Link} to="/policies" size="xs">
          Policies
        </Anchor>
      }
      below={
        <Text size="sm" c="dimmed" mt={4}>
          {policy.description}
        </Text>
      }
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
