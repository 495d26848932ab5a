/** Chooses which checkpoints of a training stay, and how fine its curves; says what that takes before it is done. */
import { Button, Checkbox, Group, List, Modal, NumberInput, Stack, Tabs, Text } from '@mantine/core'
import { useDebouncedValue } from '@mantine/hooks'
import { keepPreviousData } from '@tanstack/react-query'
import { useState } from 'react'
import { $api, $now } from '../../api/client'
import type { KeepRule, StoredExperiment } from '../../api/types'
import { count, fileSize, plural } from '../../lib/format'
import { useChange } from '../people/useChange'
import { Segments } from '../Segments'
import { CurveRuleForm } from './CurveRuleForm'
import { goingInWords } from './rules'

const FIRST: KeepRule = { last: 3, every: 10, best: true }
const SHOWN = 5

export interface RuleDialogProps {
  experiment: StoredExperiment
  /** Until what a rule takes is gone. */
  days: number
  onClose: () => void
}

export function RuleDialog(props: RuleDialogProps) {
  const { experiment, onClose } = props
  return (
    <Modal opened onClose={onClose} title={`Clean up “${experiment.name}”`} size="lg">
      <Tabs defaultValue="checkpoints" keepMounted={false}>
        <Tabs.List mb="md">
          <Tabs.Tab value="checkpoints">Checkpoints</Tabs.Tab>
          <Tabs.Tab value="curves">Curves</Tabs.Tab>
        </Tabs.List>
        <Tabs.Panel value="checkpoints">
          <CheckpointRuleForm {...props} />
        </Tabs.Panel>
        <Tabs.Panel value="curves">
          <CurveRuleForm {...props} />
        </Tabs.Panel>
      </Tabs>
    </Modal>
  )
}

function CheckpointRuleForm({ experiment, days, onClose }: RuleDialogProps) {
  const change = useChange()
  const [all, setAll] = useState(experiment.rule.last == null && experiment.own_rule)
  const [rule, setRule] = useState<KeepRule>(experiment.rule.last == null ? FIRST : experiment.rule)
  const wanted: KeepRule = all ? { last: null, every: null, best: true } : rule
  const [asked] = useDebouncedValue(wanted, 200)
  const path = { experiment_id: experiment.id }
  const preview = $now.useQuery(
    'get',
    '/api/experiments/{experiment_id}/thinning',
    {
      params: {
        path,
        query: {
          best: asked.best,
          ...(asked.last == null ? {} : { last: asked.last }),
          ...(asked.every == null ? {} : { every: asked.every }),
        },
      },
    },
    { placeholderData: keepPreviousData },
  )
  const apply = $api.useMutation('put', '/api/experiments/{experiment_id}/thinning', change('apply the rule'))
  const free = $api.useMutation(
    'post',
    '/api/experiments/{experiment_id}/thinning/free',
    change('free the space'),
  )
  const found = preview.data
  const busy = apply.isPending || free.isPending
  const put = (next: KeepRule | null) =>
    apply.mutate({ params: { path }, body: { rule: next } }, { onSuccess: onClose })
  return (
    <Stack>
      <Segments
        aria-label="What stays"
        value={all ? 'all' : 'some'}
        onChange={(value) => setAll(value === 'all')}
        data={[
          { value: 'some', label: 'Some stay' },
          { value: 'all', label: 'All stay' },
        ]}
      />
      {!all && (
        <>
          <Group grow align="flex-start">
            <NumberInput
              label="Newest of each run"
              min={1}
              max={10_000}
              allowDecimal={false}
              value={rule.last ?? 1}
              onChange={(value) => setRule({ ...rule, last: Number(value) || 1 })}
            />
            <NumberInput
              label="And one in so many"
              description="From the first one on; empty for none"
              inputWrapperOrder={['label', 'input', 'description']}
              min={1}
              max={10_000}
              allowDecimal={false}
              value={rule.every ?? ''}
              onChange={(value) => setRule({ ...rule, every: Number(value) || null })}
            />
          </Group>
          <Checkbox
            label="And the best one"
            checked={rule.best}
            onChange={(event) => setRule({ ...rule, best: event.currentTarget.checked })}
          />
        </>
      )}
      {found && (
        <div data-testid="preview" aria-busy={preview.isFetching}>
          <Text fw={550}>{goingInWords(found.going, fileSize(found.going_bytes))}</Text>
          <Text size="sm" c="dimmed">
            {plural(found.staying, 'checkpoint')} stay.{' '}
            {found.going > 0 &&
              `What goes takes its episodes and replays along; it is gone after ${plural(days, 'day')}, and until then another rule keeps it.`}
          </Text>
          {found.spared_total > 0 && (
            <>
              <Text size="sm" mt="xs">
                The rule leaves alone:
              </Text>
              <List size="sm">
                {found.spared.slice(0, SHOWN).map((one) => (
                  <List.Item key={one.id}>
                    seed {one.seed}, step {count(one.step)}: {one.reason}
                  </List.Item>
                ))}
                {found.spared_total > SHOWN && (
                  <List.Item>and {count(found.spared_total - SHOWN)} more</List.Item>
                )}
              </List>
            </>
          )}
        </div>
      )}
      <Group justify="flex-end">
        {experiment.going > 0 && (
          <Button
            color="red"
            variant="light"
            loading={free.isPending}
            onClick={() => free.mutate({ params: { path } }, { onSuccess: onClose })}
            title="What went by the rule that holds now is removed at once, and can't be had back"
          >
            Free {fileSize(experiment.going_bytes)} now
          </Button>
        )}
        {experiment.own_rule && (
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
