/** Where a training comes from, and what came of it. */
import { Anchor, Text } from '@mantine/core'
import type { ReactNode } from 'react'
import { Link } from 'react-router'
import { $api } from '../api/client'
import type { Lineage } from '../api/types'
import { count } from '../lib/format'
import classes from './Lineage.module.css'
import { Panel } from './ui'

/** Of all runs of an experiment; nothing where it began with fresh weights and nothing began with it. */
export function ExperimentLineage({ experimentId }: { experimentId: string }) {
  const { data } = $api.useQuery('get', '/api/experiments/{experiment_id}/lineage', {
    params: { path: { experiment_id: experimentId } },
  })
  return data ? <LineagePanel lineage={data} /> : null
}

/** Of one run. */
export function RunLineage({ runId }: { runId: string }) {
  const { data } = $api.useQuery('get', '/api/runs/{run_id}/lineage', {
    params: { path: { run_id: runId } },
  })
  return data ? <LineagePanel lineage={data} /> : null
}

function LineagePanel({ lineage: { parent, children } }: { lineage: Lineage }) {
  if (!parent && children.length === 0) return null
  return (
    <Panel title="Lineage" data-testid="lineage">
      <dl className={classes.lineage}>
        {parent && (
          <div>
            <dt>Started from</dt>
            <dd>
              <ParentName parent={parent} />
              <Text span size="xs" c="dimmed" ml={8} title={`SHA-256 ${parent.start_from.sha256}`}>
                {parent.start_from.sha256?.slice(0, 8)}
              </Text>
            </dd>
          </div>
        )}
        {children.length > 0 && (
          <div>
            <dt>Trained further as</dt>
            {children.map(({ id, name, seed, step }) => (
              <dd key={id}>
                <Anchor component={Link} to={`/experiments/${id}`} size="sm">
                  {name}
                </Anchor>
                <Text span size="xs" c="dimmed" ml={8}>
                  from seed {seed}, step {count(step)}
                </Text>
              </dd>
            ))}
          </div>
        )}
      </dl>
    </Panel>
  )
}

function ParentName({ parent }: { parent: NonNullable<Lineage['parent']> }): ReactNode {
  const { start_from, state, run_id, step } = parent
  const title = start_from.title || start_from.name
  if (state === 'gone') return `${title} (deleted)`
  if (state === 'hidden') return `${title} (in a project that you don't see)`
  return (
    <Anchor
      component={Link}
      size="sm"
      to={run_id ? `/runs/${run_id}?step=${step}` : `/policies/${start_from.name}`}
    >
      {title}
    </Anchor>
  )
}
