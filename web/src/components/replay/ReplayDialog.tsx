/** An episode over the page: in 3D, beside its charts and beside what others did in the same place; to seek, to take away. */
import { Button, Group, Modal, MultiSelect, Text, useComputedColorScheme } from '@mantine/core'
import { useRef, useState } from 'react'
import { $now } from '../../api/client'
import type { EpisodeReplay } from '../../api/types'
import { OUTCOMES } from '../../lib/episodes'
import { count, percent } from '../../lib/format'
import { useTogetherInAddress } from '../../lib/hooks'
import { IconMaximize } from '../icons'
import { Downloads } from './Downloads'
import classes from './Replay.module.css'
import { ReplayCharts } from './ReplayCharts'
import { Stage } from './Stage'
import { letter } from './strips'
import { usePlayer } from './usePlayer'

/** Nothing of an evaluation ever changes. */
const FOR_GOOD = { staleTime: Number.POSITIVE_INFINITY, retry: false }
const ASK_MS = 700
/** Policies beside the one whose episodes these are. */
const MAX_BESIDE = 5

interface ReplayDialogProps {
  /** Whose episodes they are, as addresses of replays name it. */
  of: string
  episode: number
  /** All episodes, in the order in which one looks through them. */
  order: readonly number[]
  onReplay: (episode: number) => void
  onClose: () => void
}

export function ReplayDialog({ of, episode, order, onReplay, onClose }: ReplayDialogProps) {
  const dark = useComputedColorScheme('light') === 'dark'
  const stage = useRef<HTMLDivElement>(null)
  const frame = useRef<HTMLIFrameElement>(null)
  const [others, setOthers] = useTogetherInAddress()
  const subjects = [of, ...others.filter((each) => each !== of).slice(0, MAX_BESIDE)].join(',')
  const path = { subjects, episode }
  const replay = $now.useQuery('get', '/api/replays/{subjects}/{episode}', { params: { path } }, FOR_GOOD)
  const series = $now.useQuery(
    'get',
    '/api/replays/{subjects}/{episode}/series',
    { params: { path } },
    { ...FOR_GOOD, enabled: replay.data !== undefined },
  )
  const progress = $now.useQuery(
    'get',
    '/api/replays/{subjects}/progress',
    { params: { path: { subjects } } },
    { enabled: replay.isFetching, refetchInterval: ASK_MS, retry: false },
  )
  const page = replay.data && `${replay.data.page}${dark ? 'dark' : 'light'}/`
  const { time, seek } = usePlayer(frame, page)
  const [loaded, setLoaded] = useState<string>()
  const film = $now.useQuery(
    'get',
    '/api/replays/{subjects}/{episode}/progress',
    { params: { path, query: { form: 'scene', theme: dark ? 'dark' : 'light' } } },
    { enabled: page !== undefined && loaded !== page, refetchInterval: ASK_MS, retry: false },
  )
  const place = order.indexOf(episode)
  return (
    <Modal
      opened
      onClose={onClose}
      size={1440}
      yOffset="3dvh"
      title={`Episode ${count(episode + 1)}`}
      classNames={{ content: classes.dialog ?? '', body: classes.body ?? '' }}
    >
      <div className={classes.sides}>
        <Stage
          ref={stage}
          frame={frame}
          testId="replay"
          title="The episode in 3D"
          what="replay"
          page={page}
          time={time}
          query={replay}
          progress={progress.data}
          drawn={film.data?.share}
          onLoad={() => setLoaded(page)}
        />
        <section className={classes.charts} aria-label="Charts of the episode">
          {replay.data && <ReplayCharts query={series} time={time} onSeek={seek} />}
        </section>
      </div>
      {replay.data && <Ends replay={replay.data} onSeek={seek} />}
      <Group justify="space-between" align="flex-end" mt="sm" gap="sm">
        <BesideSelect of={of} chosen={others} onChoose={setOthers} />
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
              <Downloads subjects={subjects} episode={episode} page={page} theme={dark ? 'dark' : 'light'} />
            </>
          )}
        </Group>
      </Group>
    </Modal>
  )
}

/** How it ended for each of them; a press shows the moment. */
function Ends({ replay, onSeek }: { replay: EpisodeReplay; onSeek: (seconds: number) => void }) {
  const alone = replay.policies.length === 1
  return (
    <Group gap="md" mt="sm" data-testid="replay-ends">
      {replay.policies.map((policy, place) => {
        const { label, color } = OUTCOMES[policy.outcome]
        return (
          <Button
            key={policy.of}
            variant="default"
            size="compact-sm"
            classNames={{ label: classes.end ?? '' }}
            title="Show this moment"
            onClick={() => onSeek(policy.seconds)}
          >
            {!alone && (
              <>
                <i style={{ background: policy.colour }} />
                <b>{letter(place)}</b>
                <span className={classes.who}>{policy.title}</span>
              </>
            )}
            <i style={{ background: color }} />
            {label} at {policy.seconds.toFixed(1)} s
            <span className={classes.quiet}>
              {count(policy.steps)} steps{alone && `, on ${replay.suite}`}
            </span>
          </Button>
        )
      })}
      {replay.policies.some(({ faithful }) => !faithful) && (
        <Text size="sm" c="yellow" role="alert">
          Driven again here, it ended otherwise than recorded.
        </Text>
      )}
    </Group>
  )
}

interface BesideSelectProps {
  of: string
  chosen: readonly string[]
  onChoose: (others: string[]) => void
}

/** Who else is shown in the same place. */
function BesideSelect({ of, chosen, onChoose }: BesideSelectProps) {
  const { data } = $now.useQuery(
    'get',
    '/api/replays/{subjects}/beside',
    { params: { path: { subjects: of } } },
    { retry: false },
  )
  const items = data?.items ?? []
  const unknown = chosen.filter((each) => !items.some((item) => item.of === each))
  return (
    <MultiSelect
      size="xs"
      w={{ base: '100%', sm: 420 }}
      label="Beside, in the same place"
      placeholder={
        chosen.length > 0
          ? undefined
          : data && items.length === 0
            ? 'Nobody else was measured here'
            : 'Choose a policy'
      }
      searchable
      clearable
      hidePickedOptions
      maxValues={MAX_BESIDE}
      maxDropdownHeight={260}
      nothingFoundMessage="Nobody else was measured on this suite"
      value={[...chosen]}
      onChange={onChoose}
      data={[
        ...items.map((item) => ({ value: item.of, label: `${item.title}, ${percent(item.success)}` })),
        ...unknown.map((each) => ({ value: each, label: each })),
      ]}
    />
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
