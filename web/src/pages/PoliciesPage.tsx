/** The policies that ship with Mapless: a good robot to watch before training one. */
import { Button, Skeleton, Text } from '@mantine/core'
import { useEffect, useRef } from 'react'
import { Link, useLocation } from 'react-router'
import { $api } from '../api/client'
import type { ShippedPolicy } from '../api/types'
import { ArenaPicture } from '../components/ArenaPicture'
import { Below } from '../components/Below'
import { FieldMatrix } from '../components/FieldMatrix'
import { IconPlayerPlay } from '../components/icons'
import type { ToWatch } from '../components/LiveView'
import { SuccessEstimate } from '../components/MeasuredEstimate'
import { PolicyActions } from '../components/PolicyActions'
import { Page, Panel, QueryError } from '../components/ui'
import ui from '../components/ui.module.css'
import { HEADS } from '../heads'
import { inShort, summaryOf } from '../lib/experiments'
import { percent } from '../lib/format'
import { useTitle } from '../lib/hooks'
import classes from './PoliciesPage.module.css'

/** Pixels, about. */
const CARD_HEIGHT = 240
/** Cards that a phone shows: made later, each would push away those below it. */
const SEEN_AT_ONCE = 3
const WATCH: ToWatch = { watch: true }

export function PoliciesPage() {
  useTitle(HEADS.PoliciesPage.title)
  const { data, error, refetch } = $api.useQuery('get', '/api/policies', undefined, {
    staleTime: Number.POSITIVE_INFINITY,
  })
  const { hash } = useLocation()
  const families = useRef<HTMLDivElement>(null)
  const known = data !== undefined
  const asked = hash === '#families'
  // Once the policies above it are there, all of them: they would push it out of sight.
  useEffect(() => {
    if (asked && known) families.current?.scrollIntoView?.()
  }, [asked, known])
  return (
    <Page {...HEADS.PoliciesPage}>
      {error && !data ? (
        <Panel>
          <QueryError error={error} what="list of policies" retry={refetch} />
        </Panel>
      ) : (
        <ul className={classes.list} aria-busy={!data}>
          {data
            ? data.map((policy, index) => (
                <Below key={policy.name} as="li" height={CARD_HEIGHT} now={asked || index < SEEN_AT_ONCE}>
                  <PolicyCard policy={policy} />
                </Below>
              ))
            : [0, 1, 2, 3].map((key) => <Skeleton key={key} height={CARD_HEIGHT} />)}
        </ul>
      )}
      {(known || error) && (
        <div className={classes.matrix} id="families" ref={families}>
          <Below height={500}>
            <FieldMatrix />
          </Below>
        </div>
      )}
    </Page>
  )
}

function PolicyCard({ policy }: { policy: ShippedPolicy }) {
  const page = `/policies/${policy.name}`
  return (
    <li className={classes.card} data-testid="policy">
      <div className={classes.picture}>
        <ArenaPicture arena={policy.training.task.arena} />
      </div>
      <div className={classes.text}>
        <h2 className={classes.title}>
          <Link to={page}>{policy.title}</Link>
        </h2>
        <Text size="xs" c="dimmed">
          {summaryOf(inShort(policy.training))}
        </Text>
        <Text size="sm">{policy.description}</Text>
      </div>
      <dl className={classes.figures}>
        {policy.results.map(({ suite, policy: row, baselines }) => (
          <Result key={suite} suite={suite} row={row} baseline={best(baselines)} />
        ))}
      </dl>
      <div className={classes.actions}>
        <Button
          component={Link}
          to={page}
          state={WATCH}
          size="xs"
          leftSection={<IconPlayerPlay size={14} />}
          aria-label={`Watch ${policy.title}`}
        >
          Watch
        </Button>
        <PolicyActions policy={policy} size="xs" />
      </div>
    </li>
  )
}

type Row = ShippedPolicy['results'][number]['policy']

/** The baseline that arrives most often: what a policy is held against. */
function best(baselines: Row[]): Row | undefined {
  return [...baselines].sort((one, other) => other.success.value - one.success.value)[0]
}

/** A suite's line: the policy, and the best of what needs no training. */
function Result({ suite, row, baseline }: { suite: string; row: Row; baseline: Row | undefined }) {
  return (
    <>
      <dt>{suite}</dt>
      <dd>
        <SuccessEstimate estimate={row.success} />
        {baseline && (
          <Text size="xs" className={ui.quiet}>
            {baseline.name}, untrained: {percent(baseline.success.value)}
          </Text>
        )}
      </dd>
    </>
  )
}
