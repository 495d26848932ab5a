/** The frame around every page: navigation, the state of the service, colour scheme, version. */
import {
  ActionIcon,
  Anchor,
  Group,
  Text,
  Tooltip,
  useComputedColorScheme,
  useMantineColorScheme,
} from '@mantine/core'
import { Suspense } from 'react'
import { Link, NavLink, Outlet, useLocation } from 'react-router'
import { useAlertNews } from '../alerts/useAlertNews'
import { isUnauthorized } from '../api/errors'
import { useServerEvents } from '../api/events'
import type { Status } from '../api/types'
import { useStatus } from '../api/useStatus'
import { plural } from '../lib/format'
import { LoginPage } from '../pages/LoginPage'
import { AccountMenu } from './AccountMenu'
import { IconBell, IconMoon, IconSun } from './icons'
import classes from './Shell.module.css'

export function Shell() {
  const { data: status, error, isError } = useStatus()
  const locked = isUnauthorized(error)
  // Who follows an invitation has no login yet.
  const joining = useLocation().pathname === '/join'
  const offline = isError && !locked
  useServerEvents(status !== undefined && !locked)
  useAlertNews(status !== undefined && !locked)

  return (
    <div className={classes.shell}>
      <a href="#main" className={classes.skip}>
        Skip to content
      </a>
      <header className={classes.header}>
        <Link to="/" className={classes.name} aria-label="Mapless, home">
          <img src="/favicon.svg" alt="" width={22} height={22} />
          <span>Mapless</span>
        </Link>
        {!locked && (
          <nav aria-label="Main" className={classes.nav}>
            <NavLink to="/" end>
              Trainings
            </NavLink>
            <NavLink to="/new">
              New<span className={classes.wide}> training</span>
            </NavLink>
            <NavLink to="/studies">Studies</NavLink>
            <NavLink to="/compare">Compare</NavLink>
            <NavLink to="/evaluations">
              Eval<span className={classes.wide}>uations</span>
            </NavLink>
            <NavLink to="/policies">Policies</NavLink>
            <NavLink to="/arenas">Arenas</NavLink>
            <NavLink to="/playground">Play</NavLink>
            <NavLink to="/reproduction">Paper</NavLink>
            <NavLink to="/queue">Queue</NavLink>
          </nav>
        )}
        <Group gap={10} ml="auto" wrap="nowrap">
          {!locked && <ServiceState status={status} offline={offline} />}
          {!locked && (
            <Tooltip label="Alerts">
              <ActionIcon component={Link} to="/alerts" variant="subtle" color="gray" aria-label="Alerts">
                <IconBell size={18} stroke={1.6} />
              </ActionIcon>
            </Tooltip>
          )}
          {!locked && <AccountMenu />}
          <SchemeSwitch />
        </Group>
      </header>
      {offline && status !== undefined && (
        <div role="alert" className={classes.offline} data-testid="offline">
          The server cannot be reached. What you see is the last that it said; trainings go on without it, and
          this page catches up by itself.
        </div>
      )}
      <main id="main" className={classes.main} tabIndex={-1}>
        {locked && !joining ? (
          <LoginPage />
        ) : (
          <Suspense fallback={null}>
            <Outlet />
          </Suspense>
        )}
      </main>
      <footer className={classes.footer}>
        <span>Mapless{status ? ` ${status.version}` : ''}</span>
        {status?.commit && <code>{status.commit}</code>}
        <Group gap="md" className={classes.docs}>
          {!locked && (
            <>
              <Anchor component={Link} to="/projects" inherit c="inherit">
                Projects
              </Anchor>
              <Anchor component={Link} to="/storage" inherit c="inherit">
                Storage
              </Anchor>
            </>
          )}
          <Anchor component={Link} to="/reference" inherit c="inherit">
            API
          </Anchor>
        </Group>
      </footer>
    </div>
  )
}

/** "4 workers, 2 running": whether anything can be trained, and whether anything is. */
function ServiceState({ status, offline }: { status: Status | undefined; offline: boolean }) {
  if (offline) return <Badge tone="bad" text="Offline" hint="The server cannot be reached" />
  if (!status) return <Badge tone="none" text="" hint="" />
  const { workers, running, queued } = status
  const refused = status.extensions.filter((extension) => extension.refused)
  const refusals = refused.map(({ name, refused: reason }) => `Extension ${name} is refused: ${reason}`)
  const waiting = queued > 0 ? `, ${queued} queued` : ''
  if (workers.length === 0) {
    return (
      <Badge
        tone="bad"
        text={`No worker${waiting}`}
        hint={['Trainings wait until a worker is started: mapless worker', ...refusals].join('\n')}
      />
    )
  }
  return (
    <Badge
      tone={running > 0 ? 'busy' : 'idle'}
      text={[
        plural(workers.length, 'worker') + (running > 0 ? `, ${running} running` : '') + waiting,
        ...(refused.length > 0 ? [`${plural(refused.length, 'extension')} refused`] : []),
      ].join(', ')}
      hint={[...workers.map(workerInShort), ...refusals].join('\n')}
    />
  )
}

/** "worker-1: free, my_lab 1.2; other is refused: it can't be imported". */
function workerInShort({ name, trouble, run_id, extensions }: Status['workers'][number]): string {
  const there = extensions.map((one) =>
    one.refused ? `; ${one.name} is refused: ${one.refused}` : `, ${one.name} ${one.version}`,
  )
  return `${name}: ${trouble ?? (run_id ? 'training' : 'free')}${there.join('')}`
}

function Badge({ tone, text, hint }: { tone: 'bad' | 'busy' | 'idle' | 'none'; text: string; hint: string }) {
  return (
    <Tooltip label={<span style={{ whiteSpace: 'pre-line' }}>{hint}</span>} disabled={!hint}>
      <Text
        component="span"
        size="xs"
        className={classes.badge}
        data-tone={tone}
        role="status"
        data-testid="service-state"
        tabIndex={hint ? 0 : -1}
      >
        {text}
      </Text>
    </Tooltip>
  )
}

function SchemeSwitch() {
  const { setColorScheme } = useMantineColorScheme()
  const dark = useComputedColorScheme('light') === 'dark'
  const label = dark ? 'Light colours' : 'Dark colours'
  return (
    <Tooltip label={label}>
      <ActionIcon
        variant="subtle"
        color="gray"
        aria-label={label}
        onClick={() => setColorScheme(dark ? 'light' : 'dark')}
      >
        {dark ? <IconSun size={18} stroke={1.6} /> : <IconMoon size={18} stroke={1.6} />}
      </ActionIcon>
    </Tooltip>
  )
}
