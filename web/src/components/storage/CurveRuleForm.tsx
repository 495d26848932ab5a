/** Chooses how fine the curves of a training's runs stay; says what that frees before it is done. */
import { Button, Group, NumberInput, Stack, Text } from '@mantine/core'
import { useDebouncedValue } from '@mantine/hooks'
import { keepPreviousData } from '@tanstack/react-query'
import { useState } from 'react'
import { $api, $now } from '../../api/client'
import type { CurveRule } from '../../api/types'
import { dateTime, plural } from '../../lib/format'
import { useChange } from '../people/useChange'
import { Segments } from '../Segments'
import type { RuleDialogProps } from './RuleDialog'
import { thinningInWords } from './rules'

const FIRST: CurveRule = { points: 1000, after_days: 30 }
const FEWEST = 100
const MOST = 2000

export function CurveRuleForm({ experiment, days, onClose }: RuleDialogProps) {
  const change = useChange()
  const [all, setAll] = useState(experiment.curve_rule.points == null)
  const [rule, setRule] = useState<CurveRule>(
    experiment.curve_rule.points == null ? FIRST : experiment.curve_rule,
  )
  const wanted: CurveRule = all ? { points: null, after_days: rule.after_days } : rule
  const [asked] = useDebouncedValue(wanted, 200)
  const path = { experiment_id: experiment.id }
  const preview = $now.useQuery(
    'get',
    '/api/experiments/{experiment_id}/curve-thinning',
    {
      params: {
        path,
        query: {
          after_days: asked.after_days,
          ...(asked.points == null ? {} : { points: asked.points }),
        },
      },
    },
    { placeholderData: keepPreviousData },
  )
  const apply = $api.useMutation(
    'put',
    '/api/experiments/{experiment_id}/curve-thinning',
    change('apply the rule'),
  )
  const now = $api.useMutation(
    'post',
    '/api/experiments/{experiment_id}/curve-thinning/now',
    change('thin the curves'),
  )
  const found = preview.data
  const busy = apply.isPending || now.isPending
  const put = (next: CurveRule | null) =>
    apply.mutate({ params: { path }, body: { rule: next } }, { onSuccess: onClose })
  return (
    <Stack>
      <Segments
        aria-label="How fine curves stay"
        value={all ? 'all' : 'some'}
        onChange={(value) => setAll(value === 'all')}
        data={[
          { value: 'all', label: 'Every point stays' },
          { value: 'some', label: 'Long ago, fewer' },
        ]}
      />
      {!all && (
        <Group grow align="flex-start">
          <NumberInput
            label="Points of a metric"
            min={FEWEST}
            max={MOST}
            allowDecimal={false}
            value={rule.points ?? FEWEST}
            onChange={(value) => setRule({ ...rule, points: within(Number(value)) })}
          />
          <NumberInput
            label="Days after a run's end"
            min={0}
            max={3650}
            value={rule.after_days}
            onChange={(value) => setRule({ ...rule, after_days: Math.max(0, Number(value) || 0) })}
          />
        </Group>
      )}
      {found && (
        <div data-testid="preview" aria-busy={preview.isFetching}>
          <Text fw={550}>{all ? 'Every point stays.' : thinningInWords(found)}</Text>
          {!all && (
            <Text size="sm" c="dimmed">
              Neighbours are put together: their mean, smallest and largest values stay, so that a spike stays
              a spike. Evaluations, episodes and each curve's newest point stay as they are. It is done{' '}
              {plural(days, 'day')} later, can't be had back, and is told on the run's page and in what is
              exported.
              {found.later > 0 && ` ${plural(found.later, 'run')} may follow.`}
            </Text>
          )}
          {found.thins_at !== null && (
            <Text size="sm" mt="xs">
              By the rule that holds now {plural(found.marked, 'run')} will be thinned, the first on{' '}
              {dateTime(found.thins_at)}.
            </Text>
          )}
        </div>
      )}
      <Group justify="flex-end">
        {found && found.marked > 0 && (
          <Button
            color="red"
            variant="light"
            loading={now.isPending}
            onClick={() => now.mutate({ params: { path } }, { onSuccess: onClose })}
            title="What the rule that holds now takes is put together at once, and can't be had back"
          >
            Thin {plural(found.marked, 'run')} now
          </Button>
        )}
        {experiment.own_curve_rule && (
          <Button variant="default" disabled={busy} onClick={() => put(null)}>
            The installation's rule
          </Button>
        )}
        <Button loading={apply.isPending} disabled={busy || preview.isFetching} onClick={() => put(wanted)}>
          Apply
        </Button>
      </Group>
    </Stack>
  )
}

function within(points: number): number {
  return Math.min(MOST, Math.max(FEWEST, Math.round(points) || FEWEST))
}
