/** An open playground: the picture, what time does, what stands where, what the robot perceives and makes of it. */
import { Button, Group, Text } from '@mantine/core'
import { type RefObject, useRef } from 'react'
import type { Playground } from '../../api/types'
import { count, significant } from '../../lib/format'
import { LiveFrame, useWatching, WholeScreen } from '../LiveView'
import { Segments } from '../Segments'
import { Notice, Panel } from '../ui'
import classes from './Ground.module.css'
import { KeepArena } from './KeepArena'
import { Perception } from './Perception'
import { Things } from './Things'
import { type GroundActions, useGround } from './useGround'
import { useMoment } from './useMoment'

const SPEEDS = [0.1, 0.5, 1, 2, 5]

const ENDS = { arrival: 'arrives', collision: 'collides', timeout: 'runs out of time' } as const

export function Ground({ ground }: { ground: Playground }) {
  const watching = useWatching()
  const actions = useGround(ground)
  const whole = useRef<HTMLDivElement>(null)
  const { paused, speed } = actions.settings
  return (
    <div className={classes.ground} data-testid="playground">
      <div className={classes.stage}>
        <Panel flush>
          <WholeScreen ref={whole}>
            <LiveFrame
              page={watching ? `/live/${ground.id}/` : null}
              overlay={watching ? null : 'It stands still while nobody looks.'}
              receiving={ground.driving}
              whole={whole}
            />
            <fieldset className={classes.time} aria-label="Time">
              <Group gap="xs">
                <Button size="xs" variant="default" onClick={() => actions.configure({ paused: !paused })}>
                  {paused ? 'Go on' : 'Pause'}
                </Button>
                <Button
                  size="xs"
                  variant="default"
                  disabled={!paused}
                  onClick={() => actions.change({ act: 'step', count: 1 })}
                >
                  One step
                </Button>
                <Segments
                  size="xs"
                  aria-label="Speed"
                  value={String(speed)}
                  onChange={(next) => actions.configure({ speed: Number(next) })}
                  data={SPEEDS.map((each) => ({ value: String(each), label: `${each}×` }))}
                />
              </Group>
              <Text size="xs" c="dimmed" mt={6}>
                Click the floor: the target goes there. Click a thing: it gets handles to drag it by.
              </Text>
            </fieldset>
          </WholeScreen>
        </Panel>
        <Foresight asked={ground} picture={whole} />
      </div>
      <div className={classes.stage}>
        <ThingsShown asked={ground} picture={whole} actions={actions} />
        <Perception settings={actions.settings} configure={actions.configure} />
        <KeepArena ground={ground} />
      </div>
    </div>
  )
}

interface ShownProps {
  /** As the service last said it. */
  asked: Playground
  /** Around the picture, which says more of the moment that it shows. */
  picture: RefObject<HTMLElement | null>
}

function Foresight({ asked, picture }: ShownProps) {
  const ground = { ...asked, ...useMoment(picture) }
  return (
    <Panel title="What it sees coming">
      <dl className={classes.facts} data-testid="foresight" data-sim-time={ground.sim_time}>
        <div>
          <dt>Ahead</dt>
          <dd data-testid="outcome" data-outdated={ground.outdated || undefined}>
            {ground.seconds === null
              ? '–'
              : ground.outcome
                ? `It ${ENDS[ground.outcome]} in ${ground.seconds.toFixed(1)} s`
                : `It drives on for more than ${ground.seconds.toFixed(0)} s`}
          </dd>
        </div>
        <div>
          <dt>Value</dt>
          <dd data-outdated={ground.outdated || undefined}>
            {ground.value === null ? '–' : significant(ground.value, 4)}
          </dd>
        </div>
        <div>
          <dt>Reward since the last target</dt>
          <dd>{significant(ground.reward, 3)}</dd>
        </div>
        <div>
          <dt>So far</dt>
          <dd data-testid="tally">
            {count(ground.arrivals)} arrived, {count(ground.collisions)} collided, {count(ground.timeouts)}{' '}
            timed out
          </dd>
        </div>
      </dl>
      <Text size="xs" c="dimmed" mt={8}>
        A copy of this moment is driven ahead: the line in the picture is where it goes if nobody interferes,
        the value its discounted reward until then.
      </Text>
      {ground.problem && (
        <Notice title="Not done" bad role="alert">
          {ground.problem}
        </Notice>
      )}
    </Panel>
  )
}

/** The things where the picture has them. */
function ThingsShown({ asked, picture, actions }: ShownProps & { actions: GroundActions }) {
  const ground = { ...asked, ...useMoment(picture) }
  return <Things ground={ground} actions={actions} />
}
