/** An episode in 3D over the page: to play, to seek, to take away. */
import { Button, Group, Loader, Modal, Text, useComputedColorScheme } from '@mantine/core'
import { useRef } from 'react'
import type { Replay } from '../api/types'
import { count } from '../lib/format'
import { OutcomeLabel } from './Episodes'
import { IconDownload, IconMaximize } from './icons'
import classes from './Replay.module.css'
import { QueryError } from './ui'

interface ReplayDialogProps {
  episode: number
  /** All episodes, in the order in which one looks through them. */
  order: readonly number[]
  onReplay: (episode: number) => void
  query: { data?: Replay | undefined; error: unknown; refetch: () => unknown }
  onClose: () => void
}

export function ReplayDialog({ episode, order, onReplay, query, onClose }: ReplayDialogProps) {
  const dark = useComputedColorScheme('light') === 'dark'
  const stage = useRef<HTMLDivElement>(null)
  const replay = query.data
  const place = order.indexOf(episode)
  const page = replay && `${replay.page}${dark ? 'dark' : 'light'}/`
  return (
    <Modal opened onClose={onClose} size={1080} title={`Episode ${count(episode + 1)}`}>
      <div ref={stage} className={classes.stage} data-testid="replay">
        {page ? (
          <iframe
            key={page}
            title="The episode in 3D"
            src={page}
            allow="fullscreen"
            data-testid="replay-frame"
          />
        ) : query.error ? (
          <QueryError error={query.error} what="replay" retry={() => void query.refetch()} />
        ) : (
          <div className={classes.waiting} role="status">
            <Loader size="sm" />
            Driving the evaluation once more. The first replay of a policy takes a few seconds, all others
            come at once.
          </div>
        )}
      </div>
      <Group justify="space-between" mt="sm" mih={34} gap="sm">
        {replay && (
          <Group gap="md">
            <OutcomeLabel outcome={replay.outcome} />
            <Text size="sm" c="dimmed">
              {count(replay.steps)} steps, {replay.seconds.toFixed(1)} s, on {replay.suite}
            </Text>
            {!replay.faithful && (
              <Text size="sm" c="yellow" role="alert">
                Driven again here, it ended otherwise than recorded.
              </Text>
            )}
          </Group>
        )}
        <Group gap="xs" ml="auto">
          <Step label="Previous" to={order[place - 1]} onReplay={onReplay} />
          <Step label="Next" to={place < 0 ? undefined : order[place + 1]} onReplay={onReplay} />
          {page && (
            <>
              <Button
                variant="default"
                size="xs"
                leftSection={<IconMaximize size={14} />}
                onClick={() => void stage.current?.requestFullscreen()}
              >
                Full screen
              </Button>
              <Button
                component="a"
                href={`${page}?download`}
                download
                variant="default"
                size="xs"
                leftSection={<IconDownload size={14} />}
                title="One file that plays in any browser, without Mapless"
              >
                Download
              </Button>
            </>
          )}
        </Group>
      </Group>
    </Modal>
  )
}

interface StepProps {
  label: string
  to: number | undefined
  onReplay: (episode: number) => void
}

/** On to a neighbour in the list. */
function Step({ label, to, onReplay }: StepProps) {
  return (
    <Button
      variant="default"
      size="xs"
      disabled={to === undefined}
      onClick={() => to !== undefined && onReplay(to)}
    >
      {label}
    </Button>
  )
}
