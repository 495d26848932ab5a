/** A shipped policy on its suites, beside what needs no training. */
import { Table } from '@mantine/core'
import type { ShippedPolicy } from '../api/types'
import { percent, significant, words } from '../lib/format'
import table from './ExperimentTable.module.css'
import { SuccessEstimate } from './MeasuredEstimate'
import ui from './ui.module.css'

interface PolicyResultsProps {
  results: ShippedPolicy['results']
}

export function PolicyResults({ results }: PolicyResultsProps) {
  return (
    <Table.ScrollContainer type="native" minWidth={620} tabIndex={0}>
      <Table className={table.table} data-testid="policy-results">
        <Table.Thead>
          <Table.Tr>
            <Table.Th>Suite</Table.Th>
            <Table.Th>Policy</Table.Th>
            <Table.Th>Success, 95 % interval</Table.Th>
            <Table.Th ta="right">Collision</Table.Th>
            <Table.Th ta="right">Time-out</Table.Th>
            <Table.Th ta="right" title="Success weighted by path length">
              SPL
            </Table.Th>
            <Table.Th ta="right">Steps to target</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {results.flatMap(({ suite, policy, baselines }) =>
            [policy, ...baselines].map((row) => (
              <Table.Tr key={`${suite} ${row.name}`} fw={row === policy ? 550 : undefined}>
                <Table.Td className={row === policy ? undefined : ui.quiet}>
                  {row === policy ? suite : ''}
                </Table.Td>
                <Table.Td className={row === policy ? undefined : ui.quiet}>
                  {row === policy ? 'This one' : words(row.name)}
                </Table.Td>
                <Table.Td>
                  <SuccessEstimate estimate={row.success} />
                </Table.Td>
                <Table.Td ta="right" className={ui.number}>
                  {percent(row.collision)}
                </Table.Td>
                <Table.Td ta="right" className={ui.number}>
                  {percent(row.timeout)}
                </Table.Td>
                <Table.Td ta="right" className={ui.number}>
                  {row.spl.toFixed(2)}
                </Table.Td>
                <Table.Td ta="right" className={ui.number}>
                  {row.steps === null ? '–' : significant(row.steps, 3)}
                </Table.Td>
              </Table.Tr>
            )),
          )}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  )
}
