/** How a study searches: how many trials, chosen how, with how many seeds. */
import { NumberInput, Select, Stack, Switch, Text } from '@mantine/core'
import type { components } from '../../api/schema'
import { plural } from '../../lib/format'

type StudyLaunch = components['schemas']['StudyLaunch']
export type StudyChoices = Required<Pick<StudyLaunch, 'trials' | 'sampler' | 'at_once' | 'stop_early'>> & {
  seeds: number
}

export const FIRST_CHOICES: StudyChoices = {
  trials: 30,
  sampler: 'tpe',
  at_once: 2,
  stop_early: true,
  seeds: 3,
}

/** With fewer, a trial's score says more of luck than of its settings. */
const LEAST_SEEDS = 3
const MOST_SEEDS = 20
const MOST_TRIALS = 500
const MOST_AT_ONCE = 20

export const SAMPLERS: { value: StudyChoices['sampler']; label: string; meaning: string }[] = [
  { value: 'tpe', label: 'TPE', meaning: 'Goes on where trials did well.' },
  { value: 'random', label: 'Random', meaning: 'Looks at no results: what others are measured by.' },
  { value: 'quasi', label: 'Sobol sequence', meaning: 'Looks at no results, and fills the space evenly.' },
  { value: 'grid', label: 'Grid', meaning: 'Takes each combination once, five values of each range.' },
]

interface StudySettingsProps {
  /** How many settings are searched. */
  settings: number
  choices: StudyChoices
  onChange: (choices: StudyChoices) => void
}

export function StudySettings({ settings, choices, onChange }: StudySettingsProps) {
  const number = (
    key: 'trials' | 'seeds' | 'at_once',
    label: string,
    description: string,
    min: number,
    max: number,
  ) => (
    <NumberInput
      label={label}
      description={description}
      inputWrapperOrder={['label', 'input', 'error', 'description']}
      min={min}
      max={max}
      clampBehavior="blur"
      allowDecimal={false}
      value={choices[key]}
      onChange={(next) => onChange({ ...choices, [key]: typeof next === 'number' ? next : min })}
    />
  )
  return (
    <Stack gap="md" role="group" aria-label="Study">
      <Text size="sm">
        {plural(settings, 'setting')} searched: this is a study. The best trial is the one with the most
        success over its seeds (interquartile mean); among equals, the one that is soonest at the target.
      </Text>
      {number('trials', 'Trials', 'Choices of the settings to train.', 1, MOST_TRIALS)}
      <Select
        label="Chosen by"
        description={SAMPLERS.find((one) => one.value === choices.sampler)?.meaning}
        inputWrapperOrder={['label', 'input', 'error', 'description']}
        allowDeselect={false}
        data={SAMPLERS.map(({ value, label }) => ({ value, label }))}
        value={choices.sampler}
        onChange={(next) => next && onChange({ ...choices, sampler: next as StudyChoices['sampler'] })}
      />
      {number('seeds', 'Seeds of each trial', 'The best is judged on five others.', LEAST_SEEDS, MOST_SEEDS)}
      {number('at_once', 'Trials at once', 'The fewer, the more each can learn of.', 1, MOST_AT_ONCE)}
      <Switch
        label="Stop unpromising trials early"
        description="From a quarter of the steps on, where one's best is below the median of what complete trials had by then."
        checked={choices.stop_early}
        onChange={(event) => onChange({ ...choices, stop_early: event.currentTarget.checked })}
      />
    </Stack>
  )
}
