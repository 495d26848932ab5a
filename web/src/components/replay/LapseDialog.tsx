/** A run's learning over the page: the same scenarios, driven by one checkpoint after another. */
import { Button, Group, Modal, Text, useComputedColorScheme } from '@mantine/core'
import { useRef } from 'react'
import { $now } from '../../api/client'
import { count, percent } from '../../lib/format'
import { DownloadPage, Stage } from './Stage'
import { usePlayer } from './usePlayer'

const ASK_MS = 700

export function LapseDialog({ runId, onClose }: { runId: string; onClose: () => void }) {
  const dark = useComputedColorScheme('light') === 'dark'
  const frame = useRef<HTMLIFrameElement>(null)
  const init = { params: { path: { run_id: runId } } }
  const lapse = $now.useQuery('get', '/api/runs/{run_id}/lapse', init, { retry: false })
  const progress = $now.useQuery('get', '/api/runs/{run_id}/lapse/progress', init, {
    enabled: lapse.isFetching,
    refetchInterval: ASK_MS,
    retry: false,
  })
  const page = lapse.data && `${lapse.data.page}${dark ? 'dark' : 'light'}/`
  const { time, seek } = usePlayer(frame, page)
  const chapters = lapse.data?.chapters ?? []
  const now = chapters.filter(({ begins }) => time !== null && begins <= time + 0.01).length - 1
  return (
    <Modal opened onClose={onClose} size={1080} title="Time lapse">
      <Stage
        frame={frame}
        testId="lapse"
        title="The run's learning in 3D"
        what="time lapse"
        page={page}
        time={time}
        query={lapse}
        progress={progress.data}
      />
      {lapse.data && page && (
        <>
          <Group gap={6} mt="sm" role="group" aria-label="Checkpoints">
            {chapters.map(({ step, success, begins }, place) => (
              <Button
                key={step}
                size="compact-sm"
                variant={place === now ? 'filled' : 'default'}
                aria-pressed={place === now}
                onClick={() => seek(begins)}
              >
                {count(step)}: {percent(success)}
              </Button>
            ))}
            <Group ml="auto">
              <DownloadPage page={page} />
            </Group>
          </Group>
          <Text size="xs" c="dimmed" mt={6}>
            {lapse.data.scenarios} scenarios of {lapse.data.suite}, the same at every checkpoint; the rates
            are those of the whole suite.
          </Text>
        </>
      )}
    </Modal>
  )
}
