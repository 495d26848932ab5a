/** What a drawing begins with: nothing, a map of a family, an arena that is there. */
import { Button, Group, Modal, NumberInput, Select, Stack, Text } from '@mantine/core'
import { useState } from 'react'
import { $api } from '../../api/client'
import { messageOf } from '../../api/errors'
import type { ArenaConfig, ArenaGeometry } from '../../api/types'
import { DifficultySlider } from '../DifficultySlider'
import { isFamily } from '../evaluations/choices'
import { Notice } from '../ui'
import { geometryOf } from './geometryOf'
import { EMPTY } from './things'

const NOTHING = 'nothing'
const FIRST_MAP = 0

interface StartFromProps {
  opened: boolean
  onClose: () => void
  onStart: (arena: ArenaGeometry) => void
}

export function StartFrom({ opened, onClose, onStart }: StartFromProps) {
  const [chosen, setChosen] = useState(NOTHING)
  const [difficulty, setDifficulty] = useState(0.5)
  const [seed, setSeed] = useState(FIRST_MAP)
  const [problem, setProblem] = useState<string | null>(null)
  const [pending, setPending] = useState(false)
  const arenas = $api.useQuery('get', '/api/arenas', {}, { enabled: opened })
  const config = chosen === NOTHING ? null : (JSON.parse(chosen) as ArenaConfig)
  const start = async () => {
    setProblem(null)
    setPending(true)
    try {
      onStart(config ? await geometryOf(isFamily(config) ? { ...config, difficulty, seed } : config) : EMPTY)
      onClose()
    } catch (error) {
      setProblem(messageOf(error))
    } finally {
      setPending(false)
    }
  }
  return (
    <Modal opened={opened} onClose={onClose} title="Start from">
      <Stack
        component="form"
        onSubmit={(event) => {
          event.preventDefault()
          void start()
        }}
      >
        <Select
          label="Arena"
          searchable
          allowDeselect={false}
          nothingFoundMessage="No arena by that name"
          value={chosen}
          onChange={(next) => setChosen(next ?? NOTHING)}
          data={[
            { value: NOTHING, label: 'An empty floor' },
            ...(['generated', 'fixed', 'imported'] as const).map((kind) => ({
              group: { fixed: 'Built in', generated: 'A map of a family', imported: 'Imported and drawn' }[
                kind
              ],
              items: (arenas.data ?? [])
                .filter((each) => each.kind === kind)
                .map((each) => ({ value: JSON.stringify(each.config), label: each.title })),
            })),
          ]}
        />
        {config && isFamily(config) && (
          <>
            <DifficultySlider label="Difficulty" value={difficulty} onChange={setDifficulty} />
            <NumberInput
              label="Map seed"
              maw={160}
              min={0}
              max={2 ** 31 - 1}
              allowDecimal={false}
              value={seed}
              onChange={(value) => typeof value === 'number' && setSeed(value)}
            />
          </>
        )}
        <Text size="sm" c="dimmed">
          It takes the place of what is drawn; Undo brings that back.
        </Text>
        {(problem || arenas.error) && (
          <Notice title="Not started" bad role="alert">
            {problem ?? messageOf(arenas.error)}
          </Notice>
        )}
        <Group justify="flex-end">
          <Button variant="default" onClick={onClose}>
            Cancel
          </Button>
          <Button type="submit" loading={pending} data-autofocus>
            Start
          </Button>
        </Group>
      </Stack>
    </Modal>
  )
}
