/** Every family by every policy at difficulty 1, the hardest first, beside baselines that see as much. */
import { Anchor, Skeleton, Table, Text } from '@mantine/core'
import { Link } from 'react-router'
import { $api } from '../api/client'
import type { FieldMatrix as Matrix } from '../api/types'
import { count, percent, percentRange, words } from '../lib/format'
import { endedSo } from '../lib/useArrangement'
import experiments from './ExperimentTable.module.css'
import classes from './FieldMatrix.module.css'
import { Panel, QueryError } from './ui'
import ui from './ui.module.css'

type Driver = Matrix['asked'][number]
type Cell = NonNullable<Driver['cells'][number]>

export function FieldMatrix() {
  const { data, error, refetch } = $api.useQuery('get', '/api/field')
  return (
    <Panel title="Where they have never been" flush={data !== undefined}>
      {data ? (
        <Loaded matrix={data} />
      ) : error ? (
        <QueryError error={error} what="matrix of families" retry={refetch} />
      ) : (
        <Skeleton height={420} />
      )}
    </Panel>
  )
}

function Loaded({ matrix }: { matrix: Matrix }) {
  const { families, sights, asked } = matrix
  return (
    <>
      <Text size="sm" className={classes.lead}>
        Success in every family at its hardest, in maps that no training and no choice of a policy has met,
        with 95 % intervals; below it what is left of the SPL in the tenth of the episodes that went worst.
        The family that is hardest for these policies comes first. An attempt lasts 500 steps, or four times
        as long as the shortest path takes.
      </Text>
      <Text size="xs" c="dimmed" className={classes.more}>
        {families.length} families: scroll the table to the right for the rest.
      </Text>
      <Table.ScrollContainer type="native" minWidth={860} tabIndex={0} className={classes.scroll}>
        <Table className={`${experiments.table} ${classes.matrix}`} aria-label="Success by family">
          <Table.Thead>
            <Table.Tr>
              <Table.Th className={classes.who}>Who drives</Table.Th>
              {families.map((family) => (
                <Table.Th key={family}>{words(family)}</Table.Th>
              ))}
            </Table.Tr>
          </Table.Thead>
          {sights.map(({ rays, field_of_view, drivers }) => (
            <Rows
              key={`${rays} ${field_of_view}`}
              title={`See ${field_of_view}° with ${rays} rays`}
              drivers={drivers}
              columns={families.length}
            />
          ))}
          <Rows
            title="Measured here: 20 maps, attempts as long as in their own training"
            drivers={asked}
            columns={families.length}
          >
            <Text size="sm" c="dimmed">
              Nothing yet. <Link to="/evaluations">Evaluate</Link> a policy in a family at difficulty 1, and
              it stands here.
            </Text>
          </Rows>
        </Table>
      </Table.ScrollContainer>
      <Text size="xs" c="dimmed" className={classes.foot}>
        {matrix.command}, {matrix.date}. What ships is one training seed, unless more are named: another seed
        does otherwise.
      </Text>
    </>
  )
}

interface RowsProps {
  title: string
  drivers: Driver[]
  columns: number
  /** What stands there instead, where there are no drivers. */
  children?: React.ReactNode
}

function Rows({ title, drivers, columns, children }: RowsProps) {
  const measured = drivers.filter(({ cells }) => cells.some((cell) => cell !== null))
  return (
    <Table.Tbody>
      <Table.Tr>
        <Table.Th colSpan={columns + 1} scope="rowgroup" className={classes.group}>
          {title}
        </Table.Th>
      </Table.Tr>
      {measured.map((driver) => (
        <Table.Tr
          key={`${driver.trained} ${driver.title} ${driver.cells.find(Boolean)?.evaluation}`}
          data-testid="field-row"
        >
          <Table.Th scope="row" className={`${classes.who} ${driver.trained ? classes.trained : ''}`}>
            {driver.policy ? (
              <Anchor component={Link} to={`/policies/${driver.policy}`} size="sm" fw={550}>
                {driver.title}
              </Anchor>
            ) : driver.trained ? (
              driver.title
            ) : (
              words(driver.title)
            )}
          </Table.Th>
          {driver.cells.map((cell, family) => (
            // biome-ignore lint/suspicious/noArrayIndexKey: a column is a family, and stays where it is
            <Table.Td key={family}>
              {cell ? <Measured cell={cell} /> : <span className={ui.quiet}>–</span>}
            </Table.Td>
          ))}
        </Table.Tr>
      ))}
      {measured.length === 0 && (
        <Table.Tr>
          <Table.Td colSpan={columns + 1}>{children}</Table.Td>
        </Table.Tr>
      )}
    </Table.Tbody>
  )
}

function Measured({ cell }: { cell: Cell }) {
  const { value, low, high, seeds, episodes, failed } = cell.success
  // Several seeds have an evaluation each: the board of the suite has them together.
  const address =
    seeds > 1 && cell.suite_hash
      ? `/leaderboards/${cell.suite_hash}`
      : `/evaluations/${cell.evaluation}${endedSo('arrival')}`
  const rate = <strong>{percent(value)}</strong>
  const behind = `${seeds > 1 ? `${seeds} seeds, ` : ''}${count(episodes)} episodes, ${percent(cell.collision)} collisions.`
  return (
    <span className={`${ui.number} ${classes.cell}`} title={`${behind} ${failed?.sentence ?? ''}`.trim()}>
      {cell.evaluation ? (
        <Anchor component={Link} to={address} size="sm">
          {rate}
        </Anchor>
      ) : (
        rate
      )}
      <span className={ui.quiet}>{percentRange(low, high)}</span>
      <span className={ui.quiet}>
        worst tenth {cell.worst_tenth_spl.toFixed(2)}, N = {count(episodes)}
      </span>
    </span>
  )
}
