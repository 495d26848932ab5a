/** The way of a run by its checkpoints, below the live view: which of them drives, and all of them in a time lapse. */
import { Button, Group, Slider, Text } from '@mantine/core'
import { useEffect, useState } from 'react'
import type { CheckpointStep } from '../api/types'
import { count, percent } from '../lib/format'
import { IconPlayerPlay } from './icons'
import classes from './LiveView.module.css'

interface LearningSliderProps {
  /** The oldest first. */
  steps: readonly CheckpointStep[]
  /** The one that drives; null for what the run itself shows. */
  chosen: { step: number } | null
  onChoose: (step: number | null) => void
  /** What the run itself shows. */
  own: string
  /** Absent while there is nothing to look back at. */
  onLapse: (() => void) | undefined
}

export function LearningSlider({ steps, chosen, onChoose, own, onLapse }: LearningSliderProps) {
  const place = chosen
    ? Math.max(0, steps.filter(({ step }) => step <= chosen.step).length - 1)
    : steps.length
  // Where the thumb is while it is dragged: each stop would be a policy to load.
  const [dragged, setDragged] = useState(place)
  useEffect(() => setDragged(place), [place])
  const shown = steps[dragged]
  const said = shown
    ? `Step ${count(shown.step)}${shown.success === null ? '' : `, ${percent(shown.success)} arrive`}`
    : own
  return (
    <fieldset className={classes.controls} aria-label="Learning" data-testid="learning">
      <Group gap="md" wrap="nowrap">
        <Slider
          flex={1}
          miw={90}
          thumbLabel="Watch it at a checkpoint"
          min={0}
          max={steps.length}
          step={1}
          label={null}
          value={dragged}
          onChange={setDragged}
          onChangeEnd={(end) => onChoose(steps[end]?.step ?? null)}
        />
        <Button
          size="xs"
          variant="default"
          leftSection={<IconPlayerPlay size={14} />}
          disabled={!onLapse}
          onClick={onLapse}
          title="The same scenarios at every checkpoint, one after another"
        >
          Time lapse
        </Button>
      </Group>
      <Text size="xs" c="dimmed" mt={6}>
        {said}
      </Text>
    </fieldset>
  )
}
