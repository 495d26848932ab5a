/** The drawing's name and size, and what becomes of it: kept in the gallery, trained on, measured on. */
import { Button, Group, NumberInput, Stack, Text, TextInput } from '@mantine/core'
import { useNavigate } from 'react-router'
import { messageOf } from '../../api/errors'
import type { ArenaConfig } from '../../api/types'
import { trainOn } from '../../lib/arenas'
import { evaluate, suiteInArena } from '../evaluations/choices'
import { Notice, Panel } from '../ui'
import classes from './editor.module.css'
import { LIMITS, resized } from './things'
import type { Draft } from './useDraft'
import { useKeeping } from './useKeeping'

interface KeepingProps {
  draft: Draft
  /** Whether the server would refuse it as it is. */
  refused: boolean
}

export function Keeping({ draft, refused }: KeepingProps) {
  const { arena } = draft
  const navigate = useNavigate()
  const { kept, keep, pending, error } = useKeeping(arena)
  const nameless = arena.name.trim() === ''
  const stopped = nameless || refused
  const thenGo = (to: (config: ArenaConfig) => string) => async () => {
    const config = await keep()
    if (config) navigate(to(config))
  }
  const side = (name: 'width' | 'height', label: string) => (
    <NumberInput
      label={label}
      size="xs"
      min={LIMITS.side[0]}
      max={LIMITS.side[1]}
      step={0.5}
      decimalScale={2}
      value={arena[name]}
      onChange={(value) => {
        if (typeof value !== 'number' || value < LIMITS.side[0] || value > LIMITS.side[1]) return
        if (value !== arena[name]) draft.change(resized(arena, { [name]: value }), { name })
      }}
    />
  )
  return (
    <Panel title="Arena">
      <Stack
        component="form"
        gap="sm"
        onSubmit={(event) => {
          event.preventDefault()
          if (!stopped) void keep()
        }}
      >
        <TextInput
          label="Name"
          size="xs"
          maxLength={80}
          value={arena.name}
          onChange={(event) => draft.change({ ...arena, name: event.currentTarget.value }, { name: 'name' })}
        />
        <div className={classes.fields}>
          {side('width', 'Width, m')}
          {side('height', 'Height, m')}
        </div>
        <Group gap={6}>
          <Button type="submit" size="xs" px={11} disabled={stopped || kept !== null} loading={pending}>
            Save
          </Button>
          <Button size="xs" px={11} variant="default" disabled={stopped || pending} onClick={thenGo(trainOn)}>
            Train on it
          </Button>
          <Button
            size="xs"
            px={11}
            variant="default"
            disabled={stopped || pending}
            onClick={thenGo((config) => evaluate([], [suiteInArena(config)]))}
          >
            Evaluate on it
          </Button>
        </Group>
        {error ? (
          <Notice title="Not saved" bad role="alert">
            {messageOf(error)}
          </Notice>
        ) : (
          <Text size="xs" c="dimmed" role="status">
            {kept !== null
              ? kept === arena.name
                ? `Saved: “${kept}” is in the gallery.`
                : `The same arena is in the gallery already, as “${kept}”.`
              : refused
                ? 'It can’t be saved as it is: see what was found.'
                : nameless
                  ? 'Give it a name to save it. Until then it stays in this browser.'
                  : 'Not saved yet; it stays in this browser. What is saved stays as it is: a change is saved beside it.'}
          </Text>
        )}
      </Stack>
    </Panel>
  )
}
