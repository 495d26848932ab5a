/** What may be said of each training beside the first: better, worse, equivalent, not told, or refused, and why. */
import { Group, NumberInput, Table, Text } from '@mantine/core'
import type { Comparison, ComparisonVerdict } from '../api/types'
import { plural } from '../lib/format'
import classes from './ComparisonVerdicts.module.css'
import table from './ExperimentTable.module.css'
import { Panel, Swatch } from './ui'

const MEASURES: Record<ComparisonVerdict['measure'], string> = {
  success: 'Success',
  steps_per_target: 'Steps to the target',
}
const LEAST_POINTS = 0.1
const MOST_POINTS = 50

interface ComparisonVerdictsProps {
  comparison: Comparison
  /** Success rates that differ by less are equivalent, 0 to 1. */
  margin: number
  onMargin: (margin: number) => void
}

export function ComparisonVerdicts({ comparison, margin, onMargin }: ComparisonVerdictsProps) {
  const { experiments, verdicts } = comparison
  const [base] = experiments
  const judged = verdicts.filter((verdict) => verdict.word !== 'refused').length
  return (
    <Panel
      title={`Beside ${base?.name}`}
      flush
      actions={
        <NumberInput
          label="Success is equivalent within (points)"
          size="xs"
          min={LEAST_POINTS}
          max={MOST_POINTS}
          step={1}
          decimalScale={1}
          value={margin * 100}
          onChange={(points) => {
            if (typeof points === 'number' && points >= LEAST_POINTS && points <= MOST_POINTS)
              onMargin(points / 100)
          }}
          className={classes.margin}
        />
      }
    >
      <Table.ScrollContainer type="native" minWidth={620}>
        <Table className={table.table} data-testid="verdicts">
          <Table.Thead>
            <Table.Tr>
              <Table.Th>Training</Table.Th>
              <Table.Th>Measure</Table.Th>
              <Table.Th>Verdict</Table.Th>
              <Table.Th>Why</Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {verdicts.map((verdict) => {
              const color = experiments.findIndex((one) => one.id === verdict.other)
              return (
                <Table.Tr key={`${verdict.other} ${verdict.measure}`} data-word={verdict.word}>
                  <Table.Td className={table.name}>
                    <Group gap={8} wrap="nowrap">
                      <Swatch color={color} />
                      {experiments[color]?.name}
                    </Group>
                  </Table.Td>
                  <Table.Td>{MEASURES[verdict.measure]}</Table.Td>
                  <Table.Td>
                    <span className={classes.word} data-word={verdict.word}>
                      {verdict.word}
                    </span>
                  </Table.Td>
                  <Table.Td className={classes.why}>{verdict.reason}</Table.Td>
                </Table.Tr>
              )
            })}
          </Table.Tbody>
        </Table>
      </Table.ScrollContainer>
      <Text size="xs" c="dimmed" px="md" py="sm">
        {plural(judged, 'comparison')}, seeds against seeds: a direction where the 95 % interval of the
        difference leaves out zero, equivalence where the 90 % interval lies within the margin (two one-sided
        tests). With twenty comparisons about one interval misses the truth.
      </Text>
    </Panel>
  )
}
