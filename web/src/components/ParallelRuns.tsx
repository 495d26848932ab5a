/** How many runs of a training may be under way at a time: chosen before it is launched, changed at any time. */
import { Button, Group, NumberInput, Popover, Stack, Text } from '@mantine/core'
import { useState } from 'react'
import { $api } from '../api/client'
import { useChange } from './people/useChange'

const MOST = 50
const MEANING = 'Of its runs under way; the others wait. Empty: as many as workers and installation allow.'

interface ParallelRunsInputProps {
  value: number | null
  onChange: (value: number | null) => void
  autoFocus?: boolean
}

/** A number of runs; null where nothing is set. */
export function ParallelRunsInput({ value, onChange, autoFocus = false }: ParallelRunsInputProps) {
  return (
    <NumberInput
      label="At most at a time"
      description={MEANING}
      placeholder="no limit of its own"
      inputWrapperOrder={['label', 'input', 'error', 'description']}
      allowDecimal={false}
      allowNegative={false}
      min={1}
      max={MOST}
      value={value ?? ''}
      data-autofocus={autoFocus || undefined}
      onChange={(typed) => onChange(typeof typed === 'number' && typed >= 1 ? Math.min(MOST, typed) : null)}
    />
  )
}

interface ParallelRunsProps {
  experiment: { id: string; name: string; parallel_runs: number | null }
}

/** Says the limit of a training, and changes it. */
export function ParallelRuns({ experiment }: ParallelRunsProps) {
  const { id, name, parallel_runs } = experiment
  const change = useChange()
  const [opened, setOpened] = useState(false)
  const [value, setValue] = useState(parallel_runs)
  const settled = change('change how many run at a time')
  const limit = $api.useMutation('patch', '/api/experiments/{experiment_id}', {
    ...settled,
    onSuccess: () => setOpened(false),
  })
  const said = parallel_runs === null ? 'No limit of its own' : `At most ${parallel_runs} at a time`
  const toggle = () => {
    setValue(parallel_runs)
    setOpened((before) => !before)
  }
  return (
    <Popover opened={opened} onChange={setOpened} position="bottom-end" width={280} trapFocus returnFocus>
      <Popover.Target>
        <Button
          size="compact-xs"
          variant="default"
          aria-label={`${said}: ${name}`}
          aria-expanded={opened}
          onClick={toggle}
        >
          {said}
        </Button>
      </Popover.Target>
      <Popover.Dropdown>
        <form
          onSubmit={(event) => {
            event.preventDefault()
            limit.mutate({ params: { path: { experiment_id: id } }, body: { parallel_runs: value ?? 0 } })
          }}
        >
          <Stack gap="sm">
            <ParallelRunsInput value={value} onChange={setValue} autoFocus />
            <Text size="xs" c="dimmed">
              What is under way goes on.
            </Text>
            <Group justify="flex-end" gap="xs">
              <Button size="xs" variant="default" onClick={() => setOpened(false)}>
                Cancel
              </Button>
              <Button size="xs" type="submit" loading={limit.isPending}>
                Save
              </Button>
            </Group>
          </Stack>
        </form>
      </Popover.Dropdown>
    </Popover>
  )
}
