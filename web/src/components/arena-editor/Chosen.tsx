/** What is chosen, by its numbers: for keyboards and for exactness. */
import { Button, Checkbox, Group, NumberInput, Select, Stack, Text } from '@mantine/core'
import type { ArenaGeometry } from '../../api/types'
import { Panel } from '../ui'
import classes from './editor.module.css'
import {
  added,
  duplicated,
  fullOf,
  keyOf,
  labelOf,
  type Mover,
  moved,
  type Point,
  placeOf,
  removed,
  type Thing,
  thingsOf,
  turnedTo,
  wayOf,
  withThing,
  withWay,
} from './things'
import type { Draft } from './useDraft'

interface Field {
  name: string
  label: string
  value: number
  min: number
  max: number
  step: number
}

const FAR = 100
const metres = (
  name: string,
  label: string,
  value: number,
  [min, max]: readonly [number, number] = [-FAR, FAR],
): Field => ({
  name,
  label,
  value,
  min,
  max,
  step: 0.05,
})
const degrees = (name: string, label: string, value = 0): Field => ({
  name,
  label,
  value,
  min: -360,
  max: 360,
  step: 15,
})
const SIZE = [0.01, FAR] as const

function fieldsOf(arena: ArenaGeometry, { part, index }: Thing): Field[] {
  const place = placeOf(arena, { part, index })
  const at = place ? [metres('x', 'x, m', place.x), metres('y', 'y, m', place.y)] : []
  const circle = part === 'circles' ? arena.circles[index] : undefined
  const box = part === 'boxes' ? arena.boxes[index] : undefined
  const mover = part === 'movers' ? arena.movers[index] : undefined
  if (circle) return [...at, metres('radius', 'Radius, m', circle.radius, SIZE)]
  if (box)
    return [
      ...at,
      degrees('angle', 'Angle, °', box.angle),
      metres('length', 'Length, m', box.length, SIZE),
      metres('width', 'Width, m', box.width, SIZE),
    ]
  if (mover)
    return [
      ...at,
      metres('radius', 'Radius, m', mover.radius, [0.1, 0.5]),
      ...(mover.kind === 'timed' ? [] : [metres('speed', 'Speed, m/s', mover.speed, [0.05, 1.5])]),
    ]
  return part === 'start' && arena.start ? [...at, degrees('heading', 'Heading, °', arena.start.heading)] : at
}

/** The arena with a number of a thing changed. */
function withNumber(arena: ArenaGeometry, thing: Thing, name: string, value: number): ArenaGeometry {
  const place = placeOf(arena, thing)
  if (name === 'x' || name === 'y') {
    const by: Point = { x: 0, y: 0, ...(place ? { [name]: value - place[name] } : {}) }
    return moved(arena, thing, by)
  }
  return withThing(arena, thing, { [name]: name === 'angle' || name === 'heading' ? turnedTo(value) : value })
}

export function Chosen({ draft, grid }: { draft: Draft; grid: number }) {
  const { arena, chosen } = draft
  const things = thingsOf(arena)
  const standing = chosen && things.find((thing) => keyOf(thing) === keyOf(chosen))
  const mover = standing?.part === 'movers' ? arena.movers[standing.index] : undefined
  const aside = grid || 0.25
  const copy = standing && duplicated(arena, standing, { x: aside, y: -aside })
  const full = standing && copy && fullOf(arena, standing.part as 'circles' | 'boxes' | 'movers')
  return (
    <Panel title="Things">
      <Stack gap="sm">
        <Select
          label="Chosen"
          size="xs"
          searchable
          clearable
          limit={60}
          placeholder={things.length === 0 ? 'Nothing stands here yet' : 'Nothing'}
          nothingFoundMessage="Nothing by that name"
          value={standing ? keyOf(standing) : null}
          onChange={(key) => draft.choose(things.find((thing) => keyOf(thing) === key) ?? null)}
          data={things.map((thing) => ({ value: keyOf(thing), label: labelOf(thing) }))}
        />
        {standing && (
          <>
            <div className={classes.fields}>
              {fieldsOf(arena, standing).map(({ name, label, value, ...limits }) => (
                <NumberInput
                  key={`${keyOf(standing)} ${name}`}
                  label={label}
                  size="xs"
                  decimalScale={3}
                  clampBehavior="blur"
                  value={Math.round(value * 1000) / 1000}
                  onChange={(next) => {
                    if (typeof next !== 'number' || next < limits.min || next > limits.max) return
                    if (next === Math.round(value * 1000) / 1000) return
                    draft.change(withNumber(arena, standing, name, next), {
                      name: `${name} of ${keyOf(standing)}`,
                    })
                  }}
                  {...limits}
                />
              ))}
            </div>
            {mover && <Going draft={draft} thing={standing} mover={mover} />}
            <Group gap="xs">
              <Button
                size="xs"
                variant="default"
                disabled={!copy || full !== null}
                onClick={() => copy && draft.change(copy[0], { chosen: copy[1] })}
              >
                Duplicate
              </Button>
              <Button
                size="xs"
                variant="default"
                onClick={() => draft.change(removed(arena, standing), { chosen: null })}
              >
                Take it away
              </Button>
            </Group>
          </>
        )}
        {!standing && (
          <Button
            size="xs"
            variant="default"
            disabled={fullOf(arena, 'movers') !== null}
            onClick={() => {
              const [next, thing] = added(arena, 'movers', {
                kind: 'pedestrian',
                radius: 0.25,
                speed: 1,
                sees_robots: true,
                stays: false,
                waypoints: [],
              })
              draft.change(next, { chosen: thing })
            }}
          >
            Add somebody who walks about
          </Button>
        )}
      </Stack>
    </Panel>
  )
}

const KINDS = [
  { value: 'pedestrian', label: 'Gives way (pedestrian)' },
  { value: 'patrol', label: 'Waits and turns (patrol)' },
  { value: 'walker', label: 'Straight on (walker)' },
]

/** How somebody goes their way. */
function Going({ draft, thing, mover }: { draft: Draft; thing: Thing; mover: Mover }) {
  const { arena } = draft
  const put = (next: Mover) =>
    draft.change({
      ...arena,
      movers: arena.movers.map((each, index) => (index === thing.index ? next : each)),
    })
  const way = wayOf(mover)
  const corners = way.length === 1 ? '1 corner: stands there' : `${way.length} corners`
  return (
    <Stack gap="xs">
      {mover.kind === 'timed' ? (
        <Text size="xs" c="dimmed">
          By the clock, {way.length} places in {mover.keyframes.at(-1)?.t} s
          {mover.loops ? ', again and again' : ''}. It takes no notice of anything.
        </Text>
      ) : (
        <>
          <Select
            label="Who"
            size="xs"
            allowDeselect={false}
            data={KINDS}
            value={mover.kind}
            onChange={(kind) => put(ofKind(mover, kind))}
          />
          <Checkbox
            size="xs"
            label="Sees robots"
            checked={mover.sees_robots ?? false}
            onChange={(event) => put({ ...mover, sees_robots: event.currentTarget.checked })}
          />
        </>
      )}
      {mover.kind === 'pedestrian' && way.length > 1 && (
        <Checkbox
          size="xs"
          label="Stays at the end of the way"
          checked={mover.stays ?? false}
          onChange={(event) => put({ ...mover, stays: event.currentTarget.checked })}
        />
      )}
      {(mover.kind === 'pedestrian' || mover.kind === 'patrol') && (
        <Group gap="xs">
          <Text size="xs" c="dimmed">
            {way.length === 0 ? 'No way of its own: goes where it likes' : corners}
          </Text>
          {way.length > (mover.kind === 'patrol' ? 2 : 1) && (
            <Button size="compact-xs" variant="default" onClick={() => put(withWay(mover, way.slice(0, -1)))}>
              Drop the last corner
            </Button>
          )}
        </Group>
      )}
    </Stack>
  )
}

/** The same way, gone otherwise; a walker has none. */
function ofKind(mover: Exclude<Mover, { kind: 'timed' }>, kind: string | null): Mover {
  const { radius, speed, sees_robots } = mover
  const waypoints = wayOf(mover).map(({ x, y }) => ({ x, y }))
  const common = { radius, speed, sees_robots }
  if (kind === 'walker') return { ...common, kind }
  if (kind === 'patrol') return { ...common, kind, waypoints: waypoints.length > 1 ? waypoints : [] }
  return { ...common, kind: 'pedestrian', waypoints, stays: false }
}
