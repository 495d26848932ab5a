/** The paper's tables with ours below each of its lines: means with 95 % intervals, and every seed. */
import { Anchor, Table, VisuallyHidden } from '@mantine/core'
import { Link } from 'react-router'
import type { CampaignRow, PaperTable, Reproduction, Spread } from '../../api/types'
import { percent, plural } from '../../lib/format'
import table from '../ExperimentTable.module.css'
import { Panel } from '../ui'
import ui from '../ui.module.css'
import classes from './reproduction.module.css'
import { SeedStrip } from './SeedStrip'

const DASH = '–'
const MINUS = '\u2212'

export function PaperTables({ reproduction }: { reproduction: Reproduction }) {
  const rows = new Map(reproduction.rows.map((row) => [row.id, row]))
  return reproduction.tables.map((one) => <OneTable key={one.id} table={one} rows={rows} />)
}

function OneTable({ table: paper, rows }: { table: PaperTable; rows: ReadonlyMap<string, CampaignRow> }) {
  return (
    <Panel title={paper.title} flush data-testid="paper-table">
      <Table.ScrollContainer type="native" minWidth={1160}>
        <Table layout="fixed" className={`${table.table} ${classes.table}`}>
          <Table.Thead>
            <Table.Tr>
              <Table.Th>Method</Table.Th>
              <Table.Th w={110}>
                <VisuallyHidden>Whose</VisuallyHidden>
              </Table.Th>
              <Table.Th ta="right" w={125}>
                Avg. reward
              </Table.Th>
              <Table.Th ta="right" w={100}>
                Episodes
              </Table.Th>
              <Table.Th ta="right" w={145}>
                Success
              </Table.Th>
              <Table.Th ta="right" w={140}>
                Steps per episode
              </Table.Th>
              <Table.Th ta="right" w={135}>
                Collisions
              </Table.Th>
              <Table.Th w={240}>Success of each seed</Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {paper.rows.map((id, index) => {
              const row = rows.get(id)
              return (
                row && (
                  <Lines
                    key={id}
                    row={row}
                    label={paper.labels[index] ?? row.method}
                    otherWay={[...rows.values()].find((one) => one.instead_of === id)}
                  />
                )
              )
            })}
          </Table.Tbody>
        </Table>
      </Table.ScrollContainer>
    </Panel>
  )
}

interface LinesProps {
  row: CampaignRow
  label: string
  /** The same method trained another way; undefined where it is trained one way. */
  otherWay: CampaignRow | undefined
}

function Lines({ row, label, otherWay }: LinesProps) {
  const { paper } = row
  return (
    <>
      <Table.Tr className={classes.paper} data-testid="paper-row">
        <Table.Td rowSpan={2} className={classes.method}>
          <Method row={row} label={label} />
        </Table.Td>
        <Table.Td>paper</Table.Td>
        <Figure text={paper.reward === null ? DASH : paper.reward.toFixed(2)} />
        <Figure text={paper.episodes.toFixed(0)} />
        <Figure text={percent(paper.success)} />
        <Figure text={paper.steps.toFixed(1)} />
        <Figure text={DASH} />
        <Table.Td rowSpan={2}>
          <Seeds row={row} />
        </Table.Td>
      </Table.Tr>
      <Table.Tr className={classes.ours} data-testid="our-row">
        <Ours row={row} />
      </Table.Tr>
      {otherWay && (
        <Table.Tr className={classes.ours} data-testid="other-way-row">
          <Table.Td className={classes.otherWay}>
            <Method row={otherWay} label={otherWay.method} />
          </Table.Td>
          <Ours row={otherWay} />
          <Table.Td>
            <Seeds row={otherWay} />
          </Table.Td>
        </Table.Tr>
      )}
    </>
  )
}

function Method({ row, label }: { row: CampaignRow; label: string }) {
  if (!row.experiment_id) return label
  return (
    <Anchor component={Link} to={`/experiments/${row.experiment_id}`} inherit>
      {label}
    </Anchor>
  )
}

function Seeds({ row }: { row: CampaignRow }) {
  return (
    <>
      <SeedStrip row={row} />
      {row.ours && <div className={`${ui.quiet} ${classes.interval}`}>{row.ours.failed.sentence}</div>}
    </>
  )
}

function Ours({ row: { ours, runs } }: { row: CampaignRow }) {
  const done = runs.filter((run) => run.measured !== null).length
  return (
    <>
      <Table.Td className={`${ui.quiet} ${ui.number}`}>
        {done > 0 ? `ours, ${plural(done, 'seed')}` : 'ours'}
      </Table.Td>
      <Measured spread={ours?.reward} write={(value) => decimal(value, 2)} />
      <Measured spread={ours?.episodes} write={(value) => decimal(value, 0)} />
      <Measured spread={ours?.success} write={percent} />
      <Measured spread={ours?.steps} write={(value) => decimal(value, 1)} />
      <Measured spread={ours?.collisions} write={percent} />
    </>
  )
}

const decimal = (value: number, digits: number) => value.toFixed(digits).replace('-', MINUS)

function Figure({ text }: { text: string }) {
  return (
    <Table.Td ta="right" className={ui.number}>
      {text}
    </Table.Td>
  )
}

function Measured({
  spread,
  write,
}: {
  spread: Spread | null | undefined
  write: (value: number) => string
}) {
  if (!spread) return <Figure text={DASH} />
  return (
    <Table.Td ta="right" className={ui.number}>
      <strong>{write(spread.mean)}</strong>
      {spread.low !== null && spread.high !== null && (
        <div className={`${ui.quiet} ${classes.interval}`} title="95 % interval over seeds (Student's t)">
          {write(spread.low)} to {write(spread.high)}
        </div>
      )}
    </Table.Td>
  )
}
