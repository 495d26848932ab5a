/** What may be said of each training beside another: better, worse, equivalent, not told, or refused, and why. */
import { Group, NativeSelect, NumberInput, Table, Text } from '@mantine/core'
import { useMemo } from 'react'
import type { Comparison, ComparisonVerdict } from '../api/types'
import { looksOf } from '../charts/palette'
import { ExperimentSwatch } from '../charts/Swatch'
import { MOST_IN_PAIRS } from '../lib/comparison'
import { pIs, plural, pValue } from '../lib/format'
import { TableExport } from './ComparisonExport'
import classes from './ComparisonVerdicts.module.css'
import table from './ExperimentTable.module.css'
import { Panel } from './ui'
import ui from './ui.module.css'

const MEASURES: Record<ComparisonVerdict['measure'], string> = {
  success: 'Success',
  steps_per_target: 'Steps to the target',
}
const LEAST_POINTS = 0.1
const MOST_POINTS = 50

/** What trainings are held against: one of them by its id, or every other. */
export const EVERY_PAIR = 'pairs'

interface ComparisonVerdictsProps {
  comparison: Comparison
  /** Success rates that differ by less are equivalent, 0 to 1. */
  margin: number
  onMargin: (margin: number) => void
  /** An id, or `EVERY_PAIR`. */
  base: string
  onBase: (base: string) => void
  /** What is compared, and how, as the API takes it. */
  query: string
}

export function ComparisonVerdicts(props: ComparisonVerdictsProps) {
  const { comparison, margin, onMargin, base, onBase, query } = props
  const { experiments, verdicts, comparisons } = comparison
  const named = (id: string) => <NamedTraining comparison={comparison} id={id} />
  return (
    <Panel
      title="Verdicts"
      flush
      actions={
        <Group gap="md" align="end">
          <NativeSelect
            label="Held against"
            size="xs"
            value={base}
            onChange={(event) => onBase(event.currentTarget.value)}
            data={[
              ...experiments.map((one) => ({ value: one.id, label: one.name })),
              ...(experiments.length > 2 && experiments.length <= MOST_IN_PAIRS
                ? [{ value: EVERY_PAIR, label: 'each other (every pair)' }]
                : []),
            ]}
          />
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
          <TableExport table="verdicts" title="Verdicts" query={query} />
        </Group>
      }
    >
      <Table.ScrollContainer type="native" minWidth={980} tabIndex={0}>
        <Table className={table.table} data-testid="verdicts" aria-label="Verdicts">
          <Table.Thead>
            <Table.Tr>
              <Table.Th>Training</Table.Th>
              <Table.Th>Beside</Table.Th>
              <Table.Th>Measure</Table.Th>
              <Table.Th>Verdict</Table.Th>
              <Table.Th>Why</Table.Th>
              <Table.Th>p (Holm)</Table.Th>
              <Table.Th>On the same scenarios</Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {verdicts.map((verdict) => (
              <Table.Tr key={`${verdict.base} ${verdict.other} ${verdict.measure}`} data-word={verdict.word}>
                <Table.Td className={table.name}>{named(verdict.other)}</Table.Td>
                <Table.Td className={table.name}>{named(verdict.base)}</Table.Td>
                <Table.Td>{MEASURES[verdict.measure]}</Table.Td>
                <Table.Td>
                  <span className={classes.word} data-word={verdict.word}>
                    {verdict.word}
                  </span>
                </Table.Td>
                <Table.Td className={classes.why}>{verdict.reason}</Table.Td>
                <Table.Td className={ui.number}>
                  {verdict.p_holm === null ? '–' : pValue(verdict.p_holm)}
                </Table.Td>
                <Table.Td className={classes.paired}>
                  {verdict.paired ? (
                    <>
                      {`better in ${verdict.paired.better}, worse in ${verdict.paired.worse} of ${verdict.paired.scenarios}`}
                      <span className={ui.behind}>{`p ${pIs(verdict.paired.p_holm)} (Holm)`}</span>
                    </>
                  ) : (
                    '–'
                  )}
                </Table.Td>
              </Table.Tr>
            ))}
          </Table.Tbody>
        </Table>
      </Table.ScrollContainer>
      <Text size="xs" c="dimmed" px="md" py="sm">
        {plural(comparisons, 'comparison')}, seeds against seeds: a direction where the 95 % interval of the
        difference leaves out zero, equivalence where the 90 % interval lies within the margin (two one-sided
        tests). With twenty comparisons about one interval misses the truth; p (Holm) is adjusted for all of
        them. On the same scenarios the very policies that were trained are paired (exact randomisation test
        of success, signed ranks of steps): that says nothing of further seeds.
      </Text>
    </Panel>
  )
}

/** A training's name behind its colour. */
export function NamedTraining({ comparison, id }: { comparison: Comparison; id: string }) {
  const looks = useMemo(() => looksOf(comparison.experiments.map((one) => one.id)), [comparison])
  return (
    <Group gap={8} wrap="nowrap">
      <ExperimentSwatch id={id} looks={looks} />
      {comparison.experiments.find((one) => one.id === id)?.name}
    </Group>
  )
}
