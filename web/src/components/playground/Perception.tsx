/** What the robot perceives, how badly, and what the picture shows of it. */
import { Checkbox, Group, Slider, Stack, Text } from '@mantine/core'
import { useEffect, useState } from 'react'
import type { Playground } from '../../api/types'
import { Panel } from '../ui'
import classes from './Ground.module.css'
import type { GroundActions } from './useGround'

type Settings = Playground['settings']
type Dial = 'noise' | 'dropout' | 'delay' | 'blind_width' | 'blind_direction'

const DIALS: readonly {
  name: Dial
  label: string
  min: number
  max: number
  step: number
  text: (value: number) => string
}[] = [
  { name: 'noise', label: 'LiDAR noise', min: 0, max: 0.5, step: 0.01, text: (value) => `${value} m` },
  {
    name: 'dropout',
    label: 'LiDAR dropout',
    min: 0,
    max: 0.9,
    step: 0.05,
    text: (value) => `${Math.round(100 * value)} %`,
  },
  { name: 'delay', label: 'Delay', min: 0, max: 5, step: 1, text: (value) => `${value} steps` },
  { name: 'blind_width', label: 'Blind sector', min: 0, max: 360, step: 5, text: (value) => `${value}°` },
  {
    name: 'blind_direction',
    label: 'Its middle',
    min: -180,
    max: 180,
    step: 5,
    text: (value) => `${value}°`,
  },
]

interface PerceptionProps {
  settings: Settings
  configure: GroundActions['configure']
}

export function Perception({ settings, configure }: PerceptionProps) {
  return (
    <Panel title="What it perceives">
      <Stack gap={4}>
        {DIALS.map(({ name, label, text, ...limits }) => (
          <Dialled
            key={name}
            label={label}
            value={settings[name] ?? 0}
            text={text}
            onChange={(value) => configure({ [name]: value })}
            {...limits}
          />
        ))}
        <Group gap="md" mt={6}>
          {(
            [
              ['rays', 'Rays'],
              ['field', 'Arrows'],
              ['follow', 'Follow it'],
            ] as const
          ).map(([name, label]) => (
            <Checkbox
              key={name}
              size="xs"
              label={label}
              checked={settings[name] ?? false}
              onChange={(event) => configure({ [name]: event.currentTarget.checked })}
            />
          ))}
        </Group>
        <Text size="xs" c="dimmed">
          Arrows: what it would do elsewhere, from rest, facing the target.
        </Text>
      </Stack>
    </Panel>
  )
}

interface DialledProps {
  label: string
  value: number
  min: number
  max: number
  step: number
  text: (value: number) => string
  onChange: (value: number) => void
}

/** A slider that tells of its end only: each change is another world. */
function Dialled({ label, value, text, onChange, ...limits }: DialledProps) {
  // Held until the settings say the same: the next press of an arrow key goes on from here.
  const [held, setHeld] = useState<number | null>(null)
  useEffect(() => {
    if (value === held) setHeld(null)
  }, [value, held])
  return (
    <div className={classes.slider}>
      <Text size="xs" component="span" aria-hidden>
        {label}
      </Text>
      <Slider
        size="sm"
        thumbLabel={label}
        label={null}
        value={held ?? value}
        onChange={setHeld}
        onChangeEnd={onChange}
        onBlur={() => setHeld(null)}
        {...limits}
      />
      <Text size="xs" component="span" ta="right">
        {text(held ?? value)}
      </Text>
    </div>
  )
}
