/** A robot's recording: what it saw and did, what a policy would have done, and what a training can learn from it. */
import { Anchor, Button, Loader, Select, Skeleton, Slider, Stack, Text } from '@mantine/core'
import { keepPreviousData } from '@tanstack/react-query'
import { useMemo, useState } from 'react'
import { Link, useParams, useSearchParams } from 'react-router'
import { $api } from '../api/client'
import { isNotFound, isRefusal, messageOf } from '../api/errors'
import { Chart } from '../charts/Chart'
import { LinkedCharts } from '../charts/LinkedCharts'
import { policyKey } from '../components/evaluations/choices'
import { FittedTable } from '../components/recordings/FittedTable'
import { placeAt, type Reading, ROLES, type Role, stripOf } from '../components/recordings/reading'
import classes from '../components/recordings/recordings.module.css'
import { Scene } from '../components/recordings/Scene'
import { Notice, Page, Panel, QueryError } from '../components/ui'
import { duration, plural, significant } from '../lib/format'
import { useTitle } from '../lib/hooks'

const FOR_GOOD = { staleTime: Number.POSITIVE_INFINITY, retry: false }
const SECONDS = { title: 'Seconds', format: (value: number) => value.toFixed(1) }
const threeDigits = (value: number) => significant(value, 3)
const STRIPS = [
  ['forwards', 'Speed, m/s'],
  ['turning', 'Turning, rad/s'],
] as const

export function RecordingPage() {
  const { recordingId = '' } = useParams()
  const [search] = useSearchParams()
  const path = { recording_id: recordingId }
  const bag = $api.useQuery('get', '/api/recordings/{recording_id}', { params: { path } }, FOR_GOOD)
  useTitle(bag.data?.name ?? 'Recording')
  const topics = topicsIn(search)
  const reading = $api.useQuery(
    'get',
    '/api/recordings/{recording_id}/reading',
    { params: { path, query: topics } },
    { ...FOR_GOOD, placeholderData: keepPreviousData },
  )
  const error = bag.error ?? reading.error
  return (
    <Page
      title={bag.data?.name ?? 'Recording'}
      above={
        <Anchor component={Link} to="/recordings" size="xs">
          From a robot
        </Anchor>
      }
    >
      {error && isRefusal(error) && !isNotFound(error) ? (
        <Stack gap="md">
          <Notice title="This recording can't be used" bad role="alert">
            {messageOf(error)}
          </Notice>
          <div>
            <Button component={Link} to="/recordings" variant="default">
              Choose another
            </Button>
          </div>
        </Stack>
      ) : error && !reading.data ? (
        <Panel>
          <QueryError
            error={error}
            what="recording"
            retry={() => {
              void bag.refetch()
              void reading.refetch()
            }}
          />
        </Panel>
      ) : !reading.data ? (
        <Panel>
          <Stack gap="md" aria-busy="true">
            <Text size="sm" c="dimmed">
              <Loader size="xs" mr={8} />A worker reads the recording…
            </Text>
            <Skeleton height={360} />
          </Stack>
        </Panel>
      ) : (
        <Opened key={recordingId} recordingId={recordingId} reading={reading.data as Reading} />
      )}
    </Page>
  )
}

type Topics = { [role in Role]?: string }

function topicsIn(search: URLSearchParams): Topics {
  const found: Topics = {}
  for (const role of Object.keys(ROLES) as Role[]) {
    const name = search.get(role)
    if (name !== null) found[role] = name
  }
  return found
}

function Opened({ recordingId, reading }: { recordingId: string; reading: Reading }) {
  const [search, setSearch] = useSearchParams()
  const [time, setTime] = useState(0)
  const [pointing, setPointing] = useState(false)
  const policy = search.get('policy')
  const set = (name: string, value: string | null) => {
    const next = new URLSearchParams(search)
    if (value === null) next.delete(name)
    else next.set(name, value)
    setSearch(next, { replace: true })
  }
  const [source, id = ''] = (policy ?? '').split(':')
  const query = { ...topicsIn(search), [source || 'shipped']: id }
  const beside = $api.useQuery(
    'get',
    '/api/recordings/{recording_id}/beside',
    { params: { path: { recording_id: recordingId }, query } },
    { ...FOR_GOOD, enabled: policy !== null },
  )
  const held = policy === null ? undefined : beside.data
  const strips = useMemo(
    () => STRIPS.map(([axis, title]) => ({ title, data: stripOf(reading, held, axis) })),
    [reading, held],
  )
  const at = held ? placeAt(held.times, time) : 0
  const notes = [...reading.notes, ...(held?.notes ?? [])]
  return (
    <Stack gap="md">
      {notes.length > 0 && (
        <Notice title="To know" data-testid="notes">
          <ul className={classes.notes}>
            {notes.map((note) => (
              <li key={note}>{note}</li>
            ))}
          </ul>
        </Notice>
      )}
      <div className={classes.columns}>
        <Panel title={`${duration(reading.seconds)} of driving`}>
          <Stack gap="sm">
            <Scene reading={reading} beside={held} time={time} onSeek={setTime} />
            <div className={classes.time}>
              <Slider
                className={classes.slider}
                thumbLabel="Time in the recording"
                min={0}
                max={reading.seconds}
                step={0.1}
                value={time}
                onChange={setTime}
                label={null}
              />
              <Text size="sm" w={64} ta="right" data-testid="time">
                {time.toFixed(1)} s
              </Text>
            </div>
            <Topics reading={reading} onChoose={set} />
          </Stack>
        </Panel>
        <Panel title="What a policy would have done">
          <Stack gap="sm">
            <PolicySelect value={policy} onChange={(next) => set('policy', next)} />
            {policy !== null && beside.error ? (
              <Notice title="Not held beside it" bad role="alert">
                {messageOf(beside.error)}
              </Notice>
            ) : policy !== null && !held ? (
              <Text size="sm" c="dimmed" aria-busy="true">
                <Loader size="xs" mr={8} />A worker lets it look at the recording…
              </Text>
            ) : held ? (
              <>
                <Text size="sm" data-testid="moment">
                  At {time.toFixed(1)} s the robot did {significant(held.did_forwards[at] ?? 0, 2)} m/s and{' '}
                  {significant(held.did_turning[at] ?? 0, 2)} rad/s; the policy would have commanded{' '}
                  {significant(held.forwards[at] ?? 0, 2)} m/s and {significant(held.turning[at] ?? 0, 2)}{' '}
                  rad/s ({held.reasons[held.states[at] ?? 0]}).
                </Text>
                {held.partings.length > 0 ? (
                  <div>
                    <Text size="xs" fw={550} mb={4}>
                      Where they part most
                    </Text>
                    <ul className={classes.partings} aria-label="Where they part most">
                      {held.partings.map((parting) => (
                        <li key={parting.at}>
                          <Button
                            size="compact-xs"
                            variant="default"
                            aria-pressed={time === parting.at}
                            onClick={() => setTime(parting.at)}
                          >
                            {parting.at.toFixed(1)} s: {parting.metres.toFixed(2)} m
                          </Button>
                        </li>
                      ))}
                    </ul>
                    <Text size="xs" c="dimmed" mt={4}>
                      How far apart the fronts of both robots would be a second later: one that drove as this
                      one did, and one that did at once what the policy commands.
                    </Text>
                  </div>
                ) : (
                  <Text size="sm" c="dimmed">
                    They hardly part.
                  </Text>
                )}
              </>
            ) : null}
            <LinkedCharts>
              <Stack
                gap="xs"
                data-testid="strips"
                onPointerEnter={() => setPointing(true)}
                onPointerLeave={() => setPointing(false)}
              >
                {strips.map(({ title, data }) => (
                  <div key={title}>
                    <Text size="xs" fw={550}>
                      {title}
                    </Text>
                    <Chart
                      data={data}
                      label={title}
                      height={140}
                      x={SECONDS}
                      format={threeDigits}
                      at={pointing ? null : time}
                      onSeek={setTime}
                    />
                  </div>
                ))}
              </Stack>
            </LinkedCharts>
          </Stack>
        </Panel>
      </div>
      <Panel title="The robot, as the recording tells it">
        <FittedTable reading={reading} />
      </Panel>
    </Stack>
  )
}

/** What is read as what; where several topics fit, a choice. */
function Topics({ reading, onChoose }: { reading: Reading; onChoose: (role: Role, name: string) => void }) {
  return (
    <Stack gap="xs">
      {(Object.keys(ROLES) as Role[]).map((role) => {
        const fitting = reading.topics.filter((topic) => topic.role === role)
        const chosen = fitting.find((topic) => topic.chosen)
        return fitting.length > 1 ? (
          <Select
            key={role}
            size="xs"
            label={ROLES[role]}
            allowDeselect={false}
            value={chosen?.name ?? null}
            onChange={(next) => next !== null && onChoose(role, next)}
            data={fitting.map(({ name, messages }) => ({
              value: name,
              label: `${name}, ${plural(messages, 'message')}`,
            }))}
          />
        ) : (
          <Text key={role} size="xs" c="dimmed">
            {ROLES[role]}:{' '}
            {chosen ? `${chosen.name}, ${plural(chosen.messages, 'message')}` : 'none in the recording'}
          </Text>
        )
      })}
    </Stack>
  )
}

function PolicySelect({
  value,
  onChange,
}: {
  value: string | null
  onChange: (next: string | null) => void
}) {
  const shipped = $api.useQuery('get', '/api/policies', {}, { staleTime: Number.POSITIVE_INFINITY })
  const uploads = $api.useQuery('get', '/api/uploads', { params: { query: { limit: 200 } } })
  const starts = $api.useQuery('get', '/api/training/starts')
  const groups = [
    {
      group: 'Shipped',
      items: (shipped.data ?? []).map((each) => ({
        value: policyKey('shipped', each.name),
        label: each.title,
      })),
    },
    {
      group: 'Uploaded',
      items: (uploads.data?.items ?? []).map((each) => ({
        value: policyKey('uploaded', each.id),
        label: each.name,
      })),
    },
    {
      group: 'Your checkpoints',
      items: (starts.data ?? [])
        .filter(({ kind }) => kind !== 'shipped')
        .map(({ start_from: { name, title } }) => ({
          value: policyKey('checkpoint', name),
          label: title || name,
        })),
    },
  ]
  const known = groups.some(({ items }) => items.some((each) => each.value === value))
  return (
    <Select
      label="Policy"
      placeholder="Choose one to hold beside the robot"
      searchable
      clearable
      nothingFoundMessage="Nothing by that name"
      value={value}
      onChange={onChange}
      data={[
        ...(value !== null && !known ? [{ group: 'Chosen', items: [{ value, label: value }] }] : []),
        ...groups,
      ]}
    />
  )
}
