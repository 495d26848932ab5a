/** The runs of an experiment, one a seed. */
import { Anchor, Table } from '@mantine/core'
import { Link } from 'react-router'
import type { Run } from '../api/types'
import { count, duration, percent } from '../lib/format'
import classes from './ExperimentTable.module.css'
import { isActive } from './states'
import { ProgressBar, StateLabel } from './ui'
import ui from './ui.module.css'

const DASH = '–'

export function RunTable({ runs }: { runs: readonly Run[] }) {
  return (
    <Table.ScrollContainer type="native" minWidth={780}>
      <Table highlightOnHover className={classes.table} data-testid="runs">
        <Table.Thead>
          <Table.Tr>
            <Table.Th w={90}>Run</Table.Th>
            <Table.Th w={120}>State</Table.Th>
            <Table.Th>Steps</Table.Th>
            <Table.Th ta="right">Steps/s</Table.Th>
            <Table.Th ta="right">Time left</Table.Th>
            <Table.Th ta="right">Success, training</Table.Th>
            <Table.Th ta="right">Success, evaluation</Table.Th>
            <Table.Th>Worker</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {runs.map((run) => (
            <Table.Tr key={run.id} data-testid="run">
              <Table.Td fw={550} style={{ whiteSpace: 'nowrap' }}>
                <Anchor component={Link} to={`/runs/${run.id}`} inherit>
                  Seed {run.seed}
                </Anchor>
              </Table.Td>
              <Table.Td>
                <StateLabel state={run.state} />
              </Table.Td>
              <Table.Td className={ui.number}>
                {count(run.step)}
                {run.step < run.total_steps && <span className={ui.quiet}> of {count(run.total_steps)}</span>}
                {isActive(run.state) && (
                  <ProgressBar
                    value={run.step / run.total_steps}
                    state={run.state}
                    label={`Progress of seed ${run.seed}`}
                  />
                )}
              </Table.Td>
              <Table.Td ta="right" className={ui.number}>
                {run.steps_per_second === null ? DASH : count(run.steps_per_second)}
              </Table.Td>
              <Table.Td ta="right" className={ui.number}>
                {run.seconds_left === null ? DASH : duration(run.seconds_left)}
              </Table.Td>
              <Table.Td ta="right" className={ui.number}>
                {run.success_rate === null ? DASH : percent(run.success_rate)}
              </Table.Td>
              <Table.Td ta="right" className={ui.number}>
                {run.eval_success_rate === null ? DASH : percent(run.eval_success_rate)}
              </Table.Td>
              <Table.Td className={ui.quiet}>{run.worker ?? DASH}</Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  )
}
