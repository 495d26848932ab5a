/** Robots in 3D, as the server's own page in a frame, with what can be chosen about it: a run's, or a shipped policy's. */
import {
  ActionIcon,
  Button,
  Group,
  NumberInput,
  Select,
  Text,
  Tooltip,
  useComputedColorScheme,
} from '@mantine/core'
import { type QueryClient, useQuery, useQueryClient } from '@tanstack/react-query'
import { type ReactNode, type Ref, type RefObject, useEffect, useRef, useState } from 'react'
import { useLocation } from 'react-router'
import { $api } from '../api/client'
import type { LiveSettings, LiveState, RunState } from '../api/types'
import { useStatus } from '../api/useStatus'
import { at } from '../lib/base'
import { count } from '../lib/format'
import { IconMaximize, IconMinimize, IconPlayerPlay } from './icons'
import classes from './LiveView.module.css'
import { Segments } from './Segments'

const MAX_ROBOTS = 64
/** In full screen nothing is seen that lies outside. */
const WITHIN = { withinPortal: false }
const SPEEDS = [1, 2, 5, 10] as const
/** A hidden tab keeps its picture this long, so that a glance elsewhere costs nothing. */
const HIDDEN_MS = 20_000

const DESCRIPTIONS: Record<LiveSettings['mode'], string> = {
  policy: 'The newest weights, driving in real time or faster.',
  training: 'What the training robots do now, time-lapsed.',
}

interface RunLiveViewProps {
  runId: string
  state: RunState
  /** Whether there is a policy to drive once the training is over; undefined while that is not known. */
  kept: boolean | undefined
  /** Whether something else in 3D lies over the page: two pictures at once would share one machine. */
  covered: boolean
  /** The checkpoint that drives in its place; null for the run itself. */
  checkpoint: { id: string; step: number } | null
}

export function RunLiveView({ checkpoint, ...run }: RunLiveViewProps) {
  return checkpoint ? (
    <CheckpointLiveView key={checkpoint.id} checkpoint={checkpoint} covered={run.covered} />
  ) : (
    <OwnLiveView {...run} />
  )
}

function OwnLiveView({ runId, state, kept, covered }: Omit<RunLiveViewProps, 'checkpoint'>) {
  const watching = useWatching() && !covered
  const training = state === 'running' || state === 'stopping'
  const driven = !training && state !== 'queued' && kept === true
  // Who has seen it train goes on seeing it drive; who comes later asks for it: pictures in 3D are work for any machine.
  const [asked, setAsked] = useState(training)
  if (training && !asked) setAsked(true)
  const shown = training || (driven && asked)
  const { live, change } = useRunLive(runId, shown && watching)
  const { data: status } = useStatus()
  return (
    <LiveView
      // After a training the frame is another one: whoever sent the pictures before is gone.
      key={`${driven}`}
      page={shown && watching ? `/live/${runId}/` : null}
      overlay={
        shown ? (
          live ? null : (
            'Connecting …'
          )
        ) : driven ? (
          <WatchButton onClick={() => setAsked(true)}>Watch the best policy</WatchButton>
        ) : (
          overlayOf(state, kept, status?.workers.length)
        )
      }
      live={shown ? live : undefined}
      change={change}
      driven={driven}
    />
  )
}

/** A policy that a run once had. */
function CheckpointLiveView({
  checkpoint,
  covered,
}: {
  checkpoint: { id: string; step: number }
  covered: boolean
}) {
  const watching = useWatching() && !covered
  const { live, change } = useCheckpointLive(checkpoint.id, watching)
  return (
    <LiveView
      page={watching ? `/live/checkpoint-${checkpoint.id}/` : null}
      overlay={live ? null : 'Connecting …'}
      live={live}
      change={change}
      driven
      said={`The policy of step ${count(checkpoint.step)}.`}
    />
  )
}

/** What a link to a policy's page leaves for it (React Router's `state`): that its view is to begin by itself. */
export interface ToWatch {
  watch: true
}

function WatchButton({ onClick, children }: { onClick: () => void; children: string }) {
  return (
    <Button leftSection={<IconPlayerPlay size={16} />} onClick={onClick}>
      {children}
    </Button>
  )
}

export function PolicyLiveView({ name, covered }: { name: string; covered: boolean }) {
  // Who comes by a *Watch* has asked; to everybody else pictures in 3D are offered: they are work for any machine.
  const [asked, setAsked] = useState((useLocation().state as ToWatch | null)?.watch ?? false)
  const watching = useWatching() && !covered && asked
  const { live, change } = usePolicyLive(name, watching)
  return (
    <LiveView
      page={watching ? `/live/policy-${name}/` : null}
      overlay={
        asked ? (
          live ? null : (
            'Connecting …'
          )
        ) : (
          <WatchButton onClick={() => setAsked(true)}>Watch it drive</WatchButton>
        )
      }
      live={live}
      change={change}
      driven
    />
  )
}

interface LiveViewProps extends LiveControlsProps {
  /** The page inside the frame, or null while there is none. */
  page: string | null
  /** What stands in place of the picture, or null. */
  overlay: ReactNode
}

function LiveView({ page, overlay, ...controls }: LiveViewProps) {
  const whole = useRef<HTMLDivElement>(null)
  return (
    <WholeScreen ref={whole}>
      <LiveFrame
        page={page}
        overlay={overlay}
        receiving={controls.live?.status.receiving ?? false}
        whole={whole}
      />
      <LiveControls {...controls} />
    </WholeScreen>
  )
}

/** A picture with its controls, as they fill the screen together. */
export function WholeScreen({ ref, children }: { ref: Ref<HTMLDivElement>; children: ReactNode }) {
  return (
    <div ref={ref} className={classes.whole} data-testid="whole-screen">
      {children}
    </div>
  )
}

interface LiveFrameProps extends Pick<LiveViewProps, 'page' | 'overlay'> {
  /** Whether pictures come. */
  receiving: boolean
  /** What fills the screen, where that is more than the picture: it with its controls. */
  whole?: RefObject<HTMLElement | null>
}

/** The page in 3D, what stands in its place, and the way to see it as large as the screen. */
export function LiveFrame({ page, overlay, receiving, whole }: LiveFrameProps) {
  const dark = useComputedColorScheme('light') === 'dark'
  const box = useRef<HTMLDivElement>(null)
  const full = useFullScreen()
  return (
    <div ref={box} className={classes.view} data-testid="live-view" data-receiving={receiving}>
      {page && (
        <iframe
          key={`${dark}`}
          title="The robots in 3D"
          src={at(`${page}${dark ? '?darkMode' : ''}`)}
          allow="fullscreen"
          data-testid="live-frame"
        />
      )}
      {overlay && (
        <div className={classes.overlay} role="status" data-testid="live-overlay">
          {overlay}
        </div>
      )}
      {page && document.fullscreenEnabled && (
        <Tooltip label={full ? 'Leave full screen' : 'Full screen'} {...WITHIN}>
          <ActionIcon
            className={classes.full}
            variant="default"
            aria-label={full ? 'Leave full screen' : 'Full screen'}
            onClick={() =>
              void (document.fullscreenElement
                ? document.exitFullscreen()
                : (whole ?? box).current?.requestFullscreen())
            }
          >
            {full ? <IconMinimize size={16} /> : <IconMaximize size={16} />}
          </ActionIcon>
        </Tooltip>
      )}
    </div>
  )
}

/** Whether something fills the screen. */
function useFullScreen(): boolean {
  const [full, setFull] = useState(document.fullscreenElement != null)
  useEffect(() => {
    const follow = () => setFull(document.fullscreenElement != null)
    document.addEventListener('fullscreenchange', follow)
    return () => document.removeEventListener('fullscreenchange', follow)
  }, [])
  return full
}

/** What stands in place of the picture of a run that has nothing to show. */
function overlayOf(state: RunState, kept: boolean | undefined, workers: number | undefined): string | null {
  if (state === 'queued') {
    return workers === 0
      ? 'No worker is there to take this run. Start one (mapless worker), and the robots appear here.'
      : 'Waiting for a free worker. The robots appear here as soon as one takes this run.'
  }
  if (kept === undefined) return null
  return state === 'failed'
    ? 'This run failed before it kept a policy; the event log says why.'
    : 'This run ended before it kept a policy.'
}

type Change = (some: Partial<LiveSettings>) => void

/** The settings and status of a run's live view; a change shows at once and is sent on. */
function useRunLive(runId: string, enabled: boolean) {
  const client = useQueryClient()
  const init = { params: { path: { run_id: runId } } }
  const options = $api.queryOptions('get', '/api/runs/{run_id}/live', init)
  const { data } = useQuery({ ...options, enabled, refetchInterval })
  const put = $api.useMutation('put', '/api/runs/{run_id}/live', {
    onSettled: () => client.invalidateQueries({ queryKey: options.queryKey }),
  })
  return {
    live: data,
    change: changing(client, options.queryKey, data, (body) => put.mutate({ ...init, body })),
  }
}

/** The same of one of its checkpoints. */
function useCheckpointLive(id: string, enabled: boolean) {
  const client = useQueryClient()
  const init = { params: { path: { checkpoint_id: id } } }
  const options = $api.queryOptions('get', '/api/checkpoints/{checkpoint_id}/live', init)
  const { data } = useQuery({ ...options, enabled, refetchInterval })
  const put = $api.useMutation('put', '/api/checkpoints/{checkpoint_id}/live', {
    onSettled: () => client.invalidateQueries({ queryKey: options.queryKey }),
  })
  return {
    live: data,
    change: changing(client, options.queryKey, data, (body) => put.mutate({ ...init, body })),
  }
}

/** The same of a policy that ships. */
function usePolicyLive(name: string, enabled: boolean) {
  const client = useQueryClient()
  const init = { params: { path: { name } } }
  const options = $api.queryOptions('get', '/api/policies/{name}/live', init)
  const { data } = useQuery({ ...options, enabled, refetchInterval })
  const put = $api.useMutation('put', '/api/policies/{name}/live', {
    onSettled: () => client.invalidateQueries({ queryKey: options.queryKey }),
  })
  return {
    live: data,
    change: changing(client, options.queryKey, data, (body) => put.mutate({ ...init, body })),
  }
}

const refetchInterval = (query: { state: { data?: LiveState | undefined } }) =>
  query.state.data?.status.receiving ? 4_000 : 1_000

function changing(
  client: QueryClient,
  queryKey: readonly unknown[],
  live: LiveState | undefined,
  send: (settings: LiveSettings) => void,
): Change {
  return (some) => {
    if (!live) return
    const { status, ...settings } = live
    const next = { ...settings, ...some }
    client.setQueryData(queryKey, { ...next, status })
    send(next)
  }
}

/** False once the tab has been hidden for a while: then nothing is sent. */
export function useWatching(): boolean {
  const [watching, setWatching] = useState(true)
  useEffect(() => {
    let timer: ReturnType<typeof setTimeout> | undefined
    const follow = () => {
      clearTimeout(timer)
      if (document.hidden) timer = setTimeout(() => setWatching(false), HIDDEN_MS)
      else setWatching(true)
    }
    document.addEventListener('visibilitychange', follow)
    return () => {
      clearTimeout(timer)
      document.removeEventListener('visibilitychange', follow)
    }
  }, [])
  return watching
}

interface LiveControlsProps {
  live: LiveState | undefined
  change: Change
  /** Whether a finished policy drives, and no training is there to be shown. */
  driven: boolean
  /** What is seen, where it is something else than usual. */
  said?: string
}

function LiveControls({ live, change, driven, said }: LiveControlsProps) {
  const off = !live
  const mode = driven ? 'policy' : (live?.mode ?? 'policy')
  const robots = live?.robots ?? 8
  const follow = live?.follow ?? null
  return (
    <fieldset className={classes.controls} aria-label="Live view" disabled={off}>
      <Group gap="sm" align="flex-end">
        {!driven && (
          <Segments
            size="xs"
            aria-label="Show"
            disabled={off}
            value={mode}
            onChange={(next) => change({ mode: next })}
            data={[
              { value: 'policy', label: 'Policy' },
              { value: 'training', label: 'Training' },
            ]}
          />
        )}
        <Segments
          size="xs"
          aria-label="Speed"
          disabled={off || mode === 'training'}
          value={String(live?.speed ?? 1)}
          onChange={(next) => change({ speed: Number(next) as LiveSettings['speed'] & number })}
          data={SPEEDS.map((speed) => ({ value: String(speed), label: `${speed}×` }))}
        />
        <NumberInput
          size="xs"
          w={72}
          aria-label="Robots"
          disabled={off}
          min={1}
          max={MAX_ROBOTS}
          clampBehavior="strict"
          allowDecimal={false}
          value={robots}
          onChange={(next) => {
            if (typeof next === 'number')
              change({ robots: next, ...(follow !== null && follow >= next ? { follow: null } : {}) })
          }}
        />
        <Select
          size="xs"
          w={126}
          aria-label="Follow"
          disabled={off}
          comboboxProps={WITHIN}
          value={follow === null ? 'none' : String(follow)}
          onChange={(next) => change({ follow: next === null || next === 'none' ? null : Number(next) })}
          data={[
            { value: 'none', label: 'Follow none' },
            ...Array.from({ length: robots }, (_, robot) => ({
              value: String(robot),
              label: `Robot ${robot + 1}`,
            })),
          ]}
        />
        <Select
          size="xs"
          w={126}
          aria-label="LiDAR rays"
          disabled={off}
          allowDeselect={false}
          comboboxProps={WITHIN}
          value={live?.rays === false ? 'none' : (live?.ray_robots ?? 'followed')}
          onChange={(next) =>
            change(next === 'all' || next === 'followed' ? { rays: true, ray_robots: next } : { rays: false })
          }
          data={[
            { value: 'followed', label: 'Rays of one' },
            { value: 'all', label: 'Rays of all' },
            { value: 'none', label: 'No rays' },
          ]}
        />
      </Group>
      <Text size="xs" c="dimmed" mt={6}>
        {said ?? (driven ? 'The best policy, after training, in real time or faster.' : DESCRIPTIONS[mode])}
        {(live?.status.watchers ?? 0) > 1 &&
          ` ${count(live?.status.watchers ?? 0)} watch: the ${driven ? 'speed is' : 'policy or training and the speed are'} the same for all, the rest is your own.`}
      </Text>
    </fieldset>
  )
}
