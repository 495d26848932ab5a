/** Whole distributions side by side (Agarwal et al. 2021): how many attempts reach a score, how likely one improves. */

import { Group, Table, Text, Title } from '@mantine/core'
import { keepPreviousData } from '@tanstack/react-query'
import { useMemo } from 'react'
import { $api } from '../api/client'
import type { Comparison } from '../api/types'
import { MetricChart } from '../charts/MetricChart'
import { chartOfProfiles } from '../charts/shape'
import { percent, percentRange, plural, significant } from '../lib/format'
import classes from './ComparisonDistributions.module.css'
import { TableExport } from './ComparisonExport'
import { NamedTraining } from './ComparisonVerdicts'
import table from './ExperimentTable.module.css'
import { Panel } from './ui'
import ui from './ui.module.css'

const SCORE = {
  title: 'Score: path efficiency of an arrival, else 0',
  format: (value: number) => significant(value, 2),
}

/** Below so many nothing is said of seeds to come. */
const LEAST_SEEDS = 5

interface ComparisonDistributionsProps {
  comparison: Comparison
  /** What is compared, and how, as the API takes it. */
  query: string
}

export function ComparisonDistributions({ comparison, query }: ComparisonDistributionsProps) {
  const experiment = comparison.experiments.map((one) => one.id)
  const { data, error } = $api.useQuery(
    'get',
    '/api/compare/profiles',
    { params: { query: { experiment } } },
    { placeholderData: keepPreviousData },
  )
  const chart = useMemo(() => (data ? chartOfProfiles(data) : { x: [], lines: [] }), [data])
  const leftOut = leftOutOf(comparison)
  return (
    <Panel title="Whole distributions">
      <div className={classes.columns}>
        <MetricChart
          title="Performance profile"
          note="share of attempts that score more"
          data={chart}
          y="Share of attempts"
          format={percent}
          yRange={[0, 1.02]}
          x={SCORE}
          readsLast={false}
          empty={error && !data ? 'Could not be loaded' : data ? 'Nothing evaluated yet' : ''}
        />
        <div className={classes.column}>
          <Group justify="space-between">
            <Title order={3}>Probability of improvement</Title>
            {comparison.improvements.length > 0 && (
              <TableExport table="improvements" title="Probability of improvement" query={query} />
            )}
          </Group>
          {comparison.improvements.length > 0 && (
            <Table.ScrollContainer type="native" minWidth={380} tabIndex={0}>
              <Table
                className={table.table}
                aria-label="Probability of improvement"
                data-testid="improvements"
              >
                <Table.Thead>
                  <Table.Tr>
                    <Table.Th>Training</Table.Th>
                    <Table.Th>Beside</Table.Th>
                    <Table.Th>Probability of improvement</Table.Th>
                  </Table.Tr>
                </Table.Thead>
                <Table.Tbody>
                  {comparison.improvements.map(({ base, other, value, low, high }) => (
                    <Table.Tr key={`${base} ${other}`}>
                      <Table.Td className={table.name}>
                        <NamedTraining comparison={comparison} id={other} />
                      </Table.Td>
                      <Table.Td className={table.name}>
                        <NamedTraining comparison={comparison} id={base} />
                      </Table.Td>
                      <Table.Td className={ui.number}>
                        <strong>{percent(value)}</strong>{' '}
                        <span className={ui.quiet}>{percentRange(low, high)}</span>
                      </Table.Td>
                    </Table.Tr>
                  ))}
                </Table.Tbody>
              </Table>
            </Table.ScrollContainer>
          )}
          <Text size="xs" c="dimmed" mt="sm">
            {comparison.improvements.length === 0
              ? 'How likely a seed of one scores higher than a seed of the other in a scenario: told of five seeds on either side, on one suite.'
              : 'How likely a seed of one scores higher than a seed of the other in a scenario; equal scores count half, so 50 % is no difference. 95 % interval over seeds (Student’s t on the logit).'}
          </Text>
          {leftOut.length > 0 && (
            <Text size="xs" c="dimmed" mt="xs" data-testid="improvements-left-out">
              Left out: {leftOut.join('; ')}.
            </Text>
          )}
        </div>
      </div>
    </Panel>
  )
}

/** Who is in no row, and why. */
function leftOutOf({ experiments, improvements }: Comparison): string[] {
  const told = new Set(improvements.flatMap(({ base, other }) => [base, other]))
  return experiments
    .filter(({ id }) => !told.has(id))
    .map(({ name, seeds }) =>
      seeds < LEAST_SEEDS
        ? `${name} has ${seeds === 0 ? 'no seed' : plural(seeds, 'seed')} evaluated, and it takes ${LEAST_SEEDS}`
        : `${name} shares no suite with enough seeds with what it is held against`,
    )
}
