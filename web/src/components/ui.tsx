/** The small parts that every page is made of. */
import { Alert, Button, Group, Skeleton, Title } from '@mantine/core'
import type { CSSProperties, ReactNode } from 'react'
import { Link } from 'react-router'
import { isNotFound, messageOf, OfflineError } from '../api/errors'
import type { ExperimentState, RunState } from '../api/types'
import { IconAlertCircle, IconAlertTriangle } from './icons'
import { endsOf, STATES } from './states'
import classes from './ui.module.css'

export { Page, Within } from './Page'

export function Panel({
  title,
  actions,
  children,
  flush = false,
  ...rest
}: {
  title?: ReactNode
  actions?: ReactNode
  children: ReactNode
  /** Whether the content reaches the edges (tables do). */
  flush?: boolean
  'data-testid'?: string
}) {
  return (
    <section className={classes.panel} {...rest}>
      {(title || actions) && (
        <div className={classes.panelHead} style={flush ? { paddingBottom: 10 } : undefined}>
          <Title order={2}>{title}</Title>
          {actions}
        </div>
      )}
      {flush ? children : <div className={classes.panelBody}>{children}</div>}
    </section>
  )
}

/** A word of warning, or of bad news. */
export function Notice({
  title,
  bad = false,
  children,
  ...rest
}: {
  title: string
  bad?: boolean
  children: ReactNode
  role?: 'alert'
  'data-testid'?: string
}) {
  return (
    <Alert
      className={classes.notice}
      data-tone={bad ? 'bad' : 'warn'}
      icon={bad ? <IconAlertCircle size={18} /> : <IconAlertTriangle size={18} />}
      title={title}
      variant="default"
      {...rest}
    >
      {children}
    </Alert>
  )
}

/** What stands where there is nothing to show: why, and what to do about it. */
export function Message({
  icon,
  title,
  children,
  actions,
  role,
  alone = false,
}: {
  icon?: ReactNode
  title: string
  children?: ReactNode
  actions?: ReactNode
  role?: 'alert' | 'status'
  /** Whether it is all that the page says. */
  alone?: boolean
}) {
  return (
    <div className={classes.message} role={role}>
      {icon}
      <Title order={alone ? 1 : 2} size="h2">
        {title}
      </Title>
      {children && <p>{children}</p>}
      {actions && <div className={classes.actions}>{actions}</div>}
    </div>
  )
}

/** A failed query: what is missing, why, and another try. */
export function QueryError({ error, what, retry }: { error: unknown; what: string; retry: () => void }) {
  if (isNotFound(error)) {
    return (
      <Message title={`There is no such ${what}`} role="alert" actions={<WaysOn what={what} />}>
        It may have been deleted, or the address is not complete.
      </Message>
    )
  }
  const offline = error instanceof OfflineError
  return (
    <Message
      title={offline ? 'The server cannot be reached' : `The ${what} could not be loaded`}
      role="alert"
      actions={
        <Button variant="default" onClick={retry}>
          Try again
        </Button>
      }
    >
      {offline ? 'This page fills by itself as soon as the server is back.' : messageOf(error)}
    </Message>
  )
}

const TRAININGS = [
  ['/', 'All trainings'],
  ['/?place=trash', 'Look in the trash'],
] as const
/** Where to look for what is not there. */
const WAYS_ON: Record<string, readonly (readonly [to: string, label: string])[]> = {
  training: TRAININGS,
  run: TRAININGS,
  policy: [['/policies', 'All policies']],
  evaluation: [['/evaluations', 'All evaluations']],
  leaderboard: [['/leaderboards', 'All leaderboards']],
  study: [['/studies', 'All studies']],
  project: [['/projects', 'All projects']],
  recording: [['/recordings', 'All recordings']],
  playground: [['/playground', 'Open another']],
}

function WaysOn({ what }: { what: string }) {
  return (
    <Group gap="xs" justify="center">
      {(WAYS_ON[what] ?? [['/', 'All trainings']]).map(([to, label]) => (
        <Button key={to} component={Link} to={to} variant="default">
          {label}
        </Button>
      ))}
    </Group>
  )
}

interface StateLabelProps {
  state: ExperimentState
  /** Of its runs, to say how they ended where they ended differently. */
  states?: readonly RunState[]
}

export function StateLabel({ state, states = [] }: StateLabelProps) {
  const { color } = STATES[state]
  const label = state === 'mixed' ? endsOf(states) : STATES[state].label
  return (
    <span
      className={classes.state}
      data-state={state}
      data-testid="state"
      style={{ '--state-color': color } as CSSProperties}
    >
      <span className={classes.dot} />
      {label}
    </span>
  )
}

/** A bar from 0 to 1 in the state's colour. */
export function ProgressBar({
  value,
  state,
  label,
}: {
  value: number
  state: ExperimentState
  label: string
}) {
  const share = Math.min(1, Math.max(0, value)) * 100
  return (
    <div
      className={classes.progress}
      role="progressbar"
      aria-label={label}
      aria-valuemin={0}
      aria-valuemax={100}
      aria-valuenow={Math.round(share)}
      style={{ '--state-color': STATES[state].color } as CSSProperties}
    >
      <span style={{ width: `${share}%` }} />
    </div>
  )
}

/** Rows of a table that is still loading, as high as the real ones. */
export function LoadingRows({ rows, columns }: { rows: number; columns: number }) {
  return Array.from({ length: rows }, (_, row) => (
    // biome-ignore lint/suspicious/noArrayIndexKey: placeholders have no other identity.
    <tr key={row} aria-hidden>
      {Array.from({ length: columns }, (_, column) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: placeholders have no other identity.
        <td key={column} style={{ padding: '12px 10px' }}>
          <Skeleton height={12} width={column === 0 ? 16 : '70%'} />
        </td>
      ))}
    </tr>
  ))
}
