/** The robots of a run in 3D, as the server's own page in a frame, with what can be chosen about it. */
import {
  ActionIcon,
  Checkbox,
  Group,
  NumberInput,
  SegmentedControl,
  Select,
  Text,
  Tooltip,
  useComputedColorScheme,
} from '@mantine/core'
import { useQueryClient } from '@tanstack/react-query'
import { useEffect, useRef, useState } from 'react'
import { $api } from '../api/client'
import type { LiveSettings, LiveState, RunState } from '../api/types'
import { useStatus } from '../api/useStatus'
import { IconMaximize } from './icons'
import classes from './LiveView.module.css'

const MAX_ROBOTS = 64
const SPEEDS = [1, 2, 5, 10] as const
/** A hidden tab keeps its picture this long, so that a glance elsewhere costs nothing. */
const HIDDEN_MS = 20_000

const DESCRIPTIONS: Record<LiveSettings['mode'], string> = {
  policy: 'The newest weights, driving in real time or faster.',
  training: 'What the training robots do now, time-lapsed.',
}

export function LiveView({ runId, state }: { runId: string; state: RunState }) {
  const dark = useComputedColorScheme('light') === 'dark'
  const box = useRef<HTMLDivElement>(null)
  const watching = useWatching()
  const active = state === 'running' || state === 'stopping'
  const { live, change } = useLive(runId, active && watching)
  const { data: status } = useStatus()
  const overlay = overlayOf(state, status?.workers.length, live)
  return (
    <div>
      <div
        ref={box}
        className={classes.view}
        data-testid="live-view"
        data-receiving={live?.status.receiving ?? false}
      >
        {active && watching && (
          <iframe
            key={`${dark}`}
            title="The robots in 3D"
            src={`/live/${runId}/${dark ? '?darkMode' : ''}`}
            allow="fullscreen"
            data-testid="live-frame"
          />
        )}
        {overlay && (
          <div className={classes.overlay} role="status" data-testid="live-overlay">
            {overlay}
          </div>
        )}
        {active && (
          <Tooltip label="Full screen">
            <ActionIcon
              className={classes.full}
              variant="default"
              aria-label="Full screen"
              onClick={() => void box.current?.requestFullscreen()}
            >
              <IconMaximize size={16} />
            </ActionIcon>
          </Tooltip>
        )}
      </div>
      <LiveControls live={live} change={change} disabled={!active} />
    </div>
  )
}

/** What stands in place of the picture; while the run goes on, the picture itself says what it waits for. */
function overlayOf(state: RunState, workers: number | undefined, live: LiveState | undefined): string | null {
  switch (state) {
    case 'queued':
      return workers === 0
        ? 'No worker is there to take this run. Start one (mapless worker), and the robots appear here.'
        : 'Waiting for a free worker. The robots appear here as soon as one takes this run.'
    case 'completed':
      return 'This run is complete; its policy is among the checkpoints below.'
    case 'stopped':
      return 'This run was stopped. Resume it to watch it go on.'
    case 'failed':
      return 'This run failed; the event log says why.'
    default:
      return live ? null : 'Connecting …'
  }
}

/** The settings and status of a live view; a change shows at once and is sent on. */
function useLive(runId: string, enabled: boolean) {
  const client = useQueryClient()
  const init = { params: { path: { run_id: runId } } }
  const options = $api.queryOptions('get', '/api/runs/{run_id}/live', init)
  const { data } = $api.useQuery('get', '/api/runs/{run_id}/live', init, {
    enabled,
    refetchInterval: (query) => (query.state.data?.status.receiving ? 4_000 : 1_000),
  })
  const put = $api.useMutation('put', '/api/runs/{run_id}/live', {
    onSettled: () => client.invalidateQueries({ queryKey: options.queryKey }),
  })
  const change = (some: Partial<LiveSettings>) => {
    if (!data) return
    const { status, ...settings } = data
    const next = { ...settings, ...some }
    client.setQueryData(options.queryKey, { ...next, status })
    put.mutate({ ...init, body: next })
  }
  return { live: data, change }
}

/** False once the tab has been hidden for a while: then nothing is sent. */
function useWatching(): boolean {
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
  change: (some: Partial<LiveSettings>) => void
  disabled: boolean
}

function LiveControls({ live, change, disabled }: LiveControlsProps) {
  const off = disabled || !live
  const mode = live?.mode ?? 'policy'
  const robots = live?.robots ?? 8
  const follow = live?.follow ?? null
  return (
    <fieldset className={classes.controls} aria-label="Live view" disabled={off}>
      <Group gap="sm" align="flex-end">
        <SegmentedControl
          size="xs"
          aria-label="Show"
          disabled={off}
          value={mode}
          onChange={(next) => change({ mode: next as LiveSettings['mode'] })}
          data={[
            { value: 'policy', label: 'Policy' },
            { value: 'training', label: 'Training' },
          ]}
        />
        <SegmentedControl
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
        <Checkbox
          size="xs"
          label="Rays"
          disabled={off}
          checked={live?.rays ?? true}
          onChange={(event) => change({ rays: event.currentTarget.checked })}
          styles={{ body: { alignItems: 'center', height: 30 } }}
        />
      </Group>
      <Text size="xs" c="dimmed" mt={6}>
        {DESCRIPTIONS[mode]}
      </Text>
    </fieldset>
  )
}
