/** What stands in a playground, and where: the numbers behind the handles in the picture, for keyboards and for exactness. */
import { Button, Group, NumberInput, Select, Stack, Text } from '@mantine/core'
import { useDebouncedCallback } from '@mantine/hooks'
import { useRef, useState } from 'react'
import type { Playground } from '../../api/types'
import { Panel } from '../ui'
import classes from './Ground.module.css'
import { type Chosen, chosenOf, type Field, fieldsOf, keyOf, placing, thingsIn } from './things'
import type { GroundActions } from './useGround'

/** After the last key: what is typed is not a place yet. */
const TYPING_MS = 250

interface ThingsProps {
  ground: Playground
  actions: GroundActions
}

export function Things({ ground, actions }: ThingsProps) {
  const key = keyOf(ground.chosen)
  const handles = useRef<HTMLInputElement>(null)
  const chosen = chosenOf(key)
  const fields = chosen && fieldsOf(ground, chosen)
  const near = ground.robot ?? { x: 0, y: 0 }
  // Beside the robot, towards the middle: within the walls whatever the arena.
  const beside = { x: round(near.x + (near.x > 0 ? -1 : 1)), y: round(near.y + (near.y > 0 ? -1 : 1)) }
  return (
    <Panel title="Things">
      <Stack gap="sm">
        <Group gap="xs">
          <Button
            size="xs"
            variant="default"
            onClick={() => actions.change({ act: 'put circle', index: null, ...beside, radius: 0.3 })}
          >
            Add a disc
          </Button>
          <Button
            size="xs"
            variant="default"
            onClick={() =>
              actions.change({ act: 'put box', index: null, ...beside, length: 1, width: 0.4, angle: 0 })
            }
          >
            Add a box
          </Button>
          {chosen && (chosen.thing === 'circle' || chosen.thing === 'box') && (
            <Button
              size="xs"
              variant="default"
              onClick={() => {
                if (chosen.thing !== 'circle' && chosen.thing !== 'box') return
                // This button goes with it, and would take the focus along.
                handles.current?.focus()
                actions.change({ act: 'remove', thing: chosen.thing, index: chosen.index })
              }}
            >
              Remove it
            </Button>
          )}
        </Group>
        <Select
          ref={handles}
          label="Handles on"
          size="xs"
          searchable
          clearable
          placeholder="Nothing"
          value={key === '' ? null : key}
          onChange={(next) => actions.change({ act: 'choose', index: 0, ...chosenOf(next ?? '') })}
          data={thingsIn(ground)}
        />
        {chosen && fields && (
          <Places
            key={key}
            fields={fields}
            onPlace={(numbers) => actions.change(placing(chosen as Chosen, numbers))}
          />
        )}
        <Group gap="xs" align="center">
          <Text size="xs" component="span" aria-hidden>
            Push it
          </Text>
          {(
            [
              ['left', 90],
              ['right', -90],
              ['back', 180],
            ] as const
          ).map(([name, direction]) => (
            <Button
              key={name}
              size="xs"
              variant="default"
              aria-label={`Push it ${name}`}
              onClick={() => actions.change({ act: 'push', direction, distance: 0.3 })}
            >
              {name}
            </Button>
          ))}
        </Group>
      </Stack>
    </Panel>
  )
}

const round = (value: number) => Math.round(value * 100) / 100

interface PlacesProps {
  fields: readonly Field[]
  onPlace: (numbers: { [name: string]: number }) => void
}

/** Numbers that follow what they stand for until somebody changes one. */
function Places({ fields, onPlace }: PlacesProps) {
  const [typed, setTyped] = useState<{ [name: string]: number | string } | null>(null)
  const place = useDebouncedCallback((values: { [name: string]: number | string }) => {
    const numbers = Object.entries(values).filter(
      (entry): entry is [string, number] => typeof entry[1] === 'number',
    )
    if (numbers.length === fields.length) onPlace(Object.fromEntries(numbers))
  }, TYPING_MS)
  return (
    // biome-ignore lint/a11y/noStaticElementInteractions: it only hears when none of its fields has the focus any more.
    <div
      className={classes.places}
      onBlur={(event) => {
        if (!event.currentTarget.contains(event.relatedTarget)) setTyped(null)
      }}
    >
      {fields.map(({ name, label, value, step, min }) => (
        <NumberInput
          key={name}
          label={label}
          size="xs"
          step={step}
          {...(min === undefined ? {} : { min })}
          decimalScale={3}
          value={typed?.[name] ?? round(value)}
          onChange={(next) => {
            const before =
              typed ?? Object.fromEntries(fields.map((field) => [field.name, round(field.value)]))
            if (next === before[name]) return
            const now = { ...before, [name]: next }
            setTyped(now)
            place(now)
          }}
        />
      ))}
    </div>
  )
}
