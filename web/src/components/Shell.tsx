/** The frame around every page: navigation, the state of the service, colour scheme, version. */
import { useComputedColorScheme, useMantineColorScheme } from '@mantine/core'
import { memo, Suspense, useLayoutEffect, useRef } from 'react'
import { Link, NavLink, Outlet, useLocation, useNavigationType } from 'react-router'
import { AlertNews } from '../alerts/AlertNews'
import { useAccount } from '../api/account'
import { isUnauthorized } from '../api/errors'
import { useServerEvents } from '../api/events'
import type { Status } from '../api/types'
import { useStatus } from '../api/useStatus'
import { BELL, MOON, NAVIGATION, SUN } from '../frame'
import { at } from '../lib/base'
import { plural } from '../lib/format'
import { lazily } from '../lib/lazily'
import { Boundary } from './Broken'
import { Coming, pageAt } from './Coming'
import classes from './Shell.module.css'

const LoginPage = lazily(async () => (await import('../pages/LoginPage')).LoginPage)
const AccountMenu = lazily(async () => (await import('./AccountMenu')).AccountMenu)

export function Shell() {
  const { data: status, error, isError } = useStatus()
  const locked = isUnauthorized(error)
  const { data: account } = useAccount(!locked)
  // Who follows an invitation has no login yet.
  const { pathname } = useLocation()
  const joining = pathname === '/join'
  const offline = isError && !locked
  useServerEvents(status !== undefined && !locked)
  useTopOfNewPages()

  return (
    <div className={classes.shell}>
      {status !== undefined && !locked && <AlertNews />}
      <a href="#main" className={classes.skip}>
        Skip to content
      </a>
      <header className="frame-header">
        <Link to="/" className="frame-name" aria-label="Mapless, home">
          <img src={at('/favicon.svg')} alt="" width={22} height={22} />
          <span>Mapless</span>
        </Link>
        {!locked && (
          <nav aria-label="Main" className="frame-nav">
            {NAVIGATION.map(([to, label]) => {
              const [short, rest] = label.split('|')
              return (
                <NavLink key={to} to={to} end={to === '/'}>
                  {short}
                  {rest && <span className="frame-wide">{rest}</span>}
                </NavLink>
              )
            })}
          </nav>
        )}
        <div className="frame-tools">
          {!locked && <ServiceState status={status} offline={offline} />}
          {!locked && (
            <Link to="/alerts" className="frame-icon" aria-label="Alerts" title="Alerts">
              <Icon paths={BELL} />
            </Link>
          )}
          {!locked && account?.people && <AccountMenu account={account} />}
          <SchemeSwitch />
        </div>
      </header>
      {offline && status !== undefined && (
        <div role="alert" className={classes.offline} data-testid="offline">
          The server cannot be reached. What you see is the last that it said; trainings go on without it, and
          this page catches up by itself.
        </div>
      )}
      <main id="main" className={classes.main} tabIndex={-1}>
        <Content at={pathname} login={locked && !joining} />
      </main>
      <footer className={classes.footer}>
        <span>Mapless{status ? ` ${status.version}` : ''}</span>
        {status?.commit && <code>{status.commit}</code>}
        <div className={classes.docs}>
          {!locked && (
            <>
              <Link to="/projects">Projects</Link>
              <Link to="/recordings">Recordings</Link>
              <Link to="/storage">Storage</Link>
            </>
          )}
          <Link to="/reference">API</Link>
        </div>
      </footer>
    </div>
  )
}

/** Another page begins at its top; the browser goes back to where one was on the last. */
function useTopOfNewPages() {
  const { pathname, hash } = useLocation()
  const kind = useNavigationType()
  const before = useRef(pathname)
  useLayoutEffect(() => {
    if (before.current === pathname) return
    before.current = pathname
    if (kind !== 'POP' && hash === '') window.scrollTo(0, 0)
  }, [pathname, hash, kind])
}

/** Not drawn anew with the header: news of the service would draw a page that is on its way at one go, not in slices. */
const Content = memo(function Content({ at, login }: { at: string; login: boolean }) {
  return (
    <Boundary at={at}>
      {login ? (
        <LoginPage />
      ) : (
        <Suspense fallback={<Coming page={pageAt(at)} />}>
          <Outlet />
        </Suspense>
      )}
    </Boundary>
  )
})

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
    <span className={hint ? classes.hinted : undefined} data-hint={hint}>
      <span
        className={classes.badge}
        data-tone={tone}
        role="status"
        aria-description={hint}
        data-testid="service-state"
        tabIndex={hint ? 0 : -1}
      >
        {text}
      </span>
    </span>
  )
}

function SchemeSwitch() {
  const { setColorScheme } = useMantineColorScheme()
  const dark = useComputedColorScheme('light') === 'dark'
  const label = dark ? 'Light colours' : 'Dark colours'
  return (
    <button
      type="button"
      className="frame-icon"
      aria-label={label}
      title={label}
      onClick={() => setColorScheme(dark ? 'light' : 'dark')}
    >
      <Icon paths={dark ? SUN : MOON} />
    </button>
  )
}

function Icon({ paths }: { paths: readonly string[] }) {
  return (
    <svg viewBox="0 0 24 24" aria-hidden>
      {paths.map((d) => (
        <path key={d} d={d} />
      ))}
    </svg>
  )
}
