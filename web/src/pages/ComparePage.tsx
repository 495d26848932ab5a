/** Experiments side by side: curves, final figures with what stands behind them, and what differs in their settings. */
import { Anchor, Button, Group, Skeleton, Stack, Table, Text } from '@mantine/core'
import { keepPreviousData } from '@tanstack/react-query'
import { type ReactNode, useState } from 'react'
import { Link, useSearchParams } from 'react-router'
import { $api } from '../api/client'
import { isNotFound } from '../api/errors'
import type { Comparison } from '../api/types'
import { looksOf } from '../charts/palette'
import { ExperimentSwatch } from '../charts/Swatch'
import { useChartView } from '../charts/view'
import { ComparisonDistributions } from '../components/ComparisonDistributions'
import { comparisonQuery, TableExport, WholeExport } from '../components/ComparisonExport'
import { ComparisonRemains } from '../components/ComparisonRemains'
import { ComparisonVerdicts, EVERY_PAIR } from '../components/ComparisonVerdicts'
import { CurvePanels } from '../components/CurvePanels'
import table from '../components/ExperimentTable.module.css'
import { FigureEstimate } from '../components/MeasuredEstimate'
import { Message, Notice, Page, Panel, QueryError } from '../components/ui'
import ui from '../components/ui.module.css'
import { labelsOf } from '../form/labels'
import type { Schema } from '../form/schema'
import { settingText } from '../form/settingText'
import { HEADS } from '../heads'
import { count, percent, percentRange, plural } from '../lib/format'
import { useTitle } from '../lib/hooks'
import { lazily } from '../lib/lazily'

/** The list of trainings is larger than all else here, and most come with a choice made. */
const Picker = lazily(async () => (await import('../components/ComparisonPicker')).ComparisonPicker)

/** Success rates that differ by less are equivalent, unless the address says otherwise. */
const MARGIN = 0.02

/** About what tables and charts are high. */
const [HEAD_PX, FIGURES_PX, VERDICTS_PX, DISTRIBUTIONS_PX] = [40, 86, 250, 280]

export function ComparePage() {
  useTitle(HEADS.ComparePage.title)
  const [search, setSearch] = useSearchParams()
  const chosen = search.getAll('experiment')
  const [picking, setPicking] = useState(false)
  const choose = (ids: readonly string[]) =>
    setSearch(
      (before) => {
        const after = new URLSearchParams(before)
        after.delete('experiment')
        for (const id of ids) after.append('experiment', id)
        return after
      },
      { replace: true },
    )
  if (chosen.length === 0 || picking) {
    return (
      <Picker
        chosen={chosen}
        onChoose={choose}
        onDone={() => setPicking(false)}
        onStart={() => setPicking(true)}
      />
    )
  }
  const margin = Number(search.get('margin')) || MARGIN
  const wanted = search.get('base')
  const base = wanted === EVERY_PAIR || (wanted && chosen.includes(wanted)) ? wanted : null
  /** Keeps a choice in the address; what is chosen anyway does not stand there. */
  const keep = (name: string, value: string, usual?: string) =>
    setSearch(
      (before) => {
        const after = new URLSearchParams(before)
        if (value === usual) after.delete(name)
        else after.set(name, value)
        return after
      },
      { replace: true },
    )
  return (
    <Chosen
      chosen={chosen}
      margin={margin}
      onMargin={(next) => keep('margin', String(next), String(MARGIN))}
      base={base}
      onBase={(next) => keep('base', next)}
      onChange={() => setPicking(true)}
    />
  )
}

interface ChosenProps {
  chosen: readonly string[]
  margin: number
  onMargin: (margin: number) => void
  /** What the others are held against: an id, or `EVERY_PAIR`; null for what the server takes. */
  base: string | null
  onBase: (base: string) => void
  onChange: () => void
  /** What has to be said of those that are not there any more. */
  notice?: ReactNode
}

function Chosen(props: ChosenProps) {
  const { chosen, margin, onMargin, base, onBase, onChange, notice } = props
  const held = base === EVERY_PAIR ? { pairs: true } : base === null ? {} : { base }
  const query = comparisonQuery(chosen, margin, held)
  const [view] = useChartView()
  const { data, error, refetch } = $api.useQuery(
    'get',
    '/api/compare',
    { params: { query: { experiment: [...chosen], margin, ...held } } },
    { placeholderData: keepPreviousData },
  )
  if (isNotFound(error) && !notice)
    return (
      <ComparisonRemains chosen={chosen} onChange={onChange}>
        {(there, gone) => (
          <Chosen
            {...props}
            chosen={there}
            base={base === EVERY_PAIR || (base && there.includes(base)) ? base : null}
            notice={gone}
          />
        )}
      </ComparisonRemains>
    )
  return (
    <Page
      {...HEADS.ComparePage}
      below={
        <Text size="sm" c="dimmed" mt={4}>
          {plural(chosen.length, 'training')}, each in its colour everywhere
        </Text>
      }
      actions={
        <Group gap="sm">
          <WholeExport query={query} view={view} data={comparisonQuery(chosen, margin, {})} />
          <Button variant="default" onClick={onChange}>
            Choose others
          </Button>
        </Group>
      }
    >
      {error && !data ? (
        <Panel>
          <QueryError error={error} what="comparison" retry={refetch} />
        </Panel>
      ) : (
        <Stack gap="md">
          {notice}
          {data && data.warnings.length > 0 && <Warnings warnings={data.warnings} />}
          <Panel
            title="Final figures"
            flush
            actions={
              <Group gap="sm" wrap="nowrap">
                <Text size="xs" c="dimmed">
                  mean over seeds, 95 % interval (Student's t)
                </Text>
                <TableExport table="figures" title="Final figures" query={query} />
              </Group>
            }
          >
            {data ? (
              <Figures comparison={data} />
            ) : (
              <Skeleton height={HEAD_PX + FIGURES_PX * chosen.length} w="auto" />
            )}
          </Panel>
          {data && data.verdicts.length > 0 && (
            <ComparisonVerdicts
              comparison={data}
              margin={margin}
              onMargin={onMargin}
              base={base ?? data.base ?? EVERY_PAIR}
              onBase={onBase}
              query={query}
            />
          )}
          {data && data.verdicts.length > 0 && <ComparisonDistributions comparison={data} query={query} />}
          {!data && chosen.length > 1 && <Coming />}
          <CurvePanels experiments={chosen} />
          <Panel
            title="What differs in their settings"
            flush
            actions={<TableExport table="differences" title="What differs in their settings" query={query} />}
          >
            {data ? <Differences comparison={data} /> : <Skeleton height={80} m="md" w="auto" />}
          </Panel>
        </Stack>
      )}
    </Page>
  )
}

/** What stands between the figures and the curves, while it is reckoned: the curves come where they stay. */
function Coming() {
  return (
    <>
      <Panel title="Verdicts">
        <Skeleton height={VERDICTS_PX} />
      </Panel>
      <Panel title="Whole distributions">
        <Skeleton height={DISTRIBUTIONS_PX} />
      </Panel>
    </>
  )
}

function Warnings({ warnings }: { warnings: readonly string[] }) {
  return (
    <Notice title="Before reading too much into this" data-testid="warnings">
      <ul style={{ margin: 0, paddingLeft: 18 }}>
        {warnings.map((warning) => (
          <li key={warning}>{warning}</li>
        ))}
      </ul>
    </Notice>
  )
}

function Figures({ comparison }: { comparison: Comparison }) {
  const looks = looksOf(comparison.experiments.map(({ id }) => id))
  return (
    <Table.ScrollContainer type="native" minWidth={820}>
      <Table className={table.table} data-testid="figures">
        <Table.Thead>
          <Table.Tr>
            <Table.Th>Training</Table.Th>
            <Table.Th>Success</Table.Th>
            <Table.Th>Steps to the target</Table.Th>
            <Table.Th>Reward per episode</Table.Th>
            <Table.Th ta="right">N</Table.Th>
            <Table.Th>Suite</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {comparison.experiments.map((one) => (
            <Table.Tr key={one.id}>
              <Table.Td className={table.name}>
                <Group gap={8} wrap="nowrap">
                  <ExperimentSwatch id={one.id} looks={looks} />
                  <Anchor component={Link} to={`/experiments/${one.id}`} inherit>
                    {one.name}
                  </Anchor>
                </Group>
              </Table.Td>
              <Table.Td>
                <FigureEstimate estimate={one.success} format={percent} range={percentRange} />
              </Table.Td>
              <Table.Td>
                <FigureEstimate estimate={one.steps_per_target} />
              </Table.Td>
              <Table.Td>
                <FigureEstimate estimate={one.reward} />
              </Table.Td>
              <Table.Td ta="right" className={ui.number}>
                {one.seeds === 0
                  ? '–'
                  : `${plural(one.seeds, 'seed')} × ${count(one.episodes / one.seeds)} episodes`}
              </Table.Td>
              <Table.Td className={ui.quiet} title={one.suite_hash ?? undefined}>
                {one.suite ?? 'not evaluated yet'}
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  )
}

function Differences({ comparison }: { comparison: Comparison }) {
  const { experiments, differences } = comparison
  const looks = looksOf(experiments.map(({ id }) => id))
  const form = $api.useQuery('get', '/api/training/form', undefined, { staleTime: Number.POSITIVE_INFINITY })
  if (experiments.length < 2) {
    return <Message title="One training alone">Choose another to see what differs.</Message>
  }
  if (differences.length === 0) {
    return (
      <Message title="Nothing differs">Their settings are the same; only chance sets them apart.</Message>
    )
  }
  return (
    <Table.ScrollContainer type="native" minWidth={240 + 160 * experiments.length} tabIndex={0}>
      <Table className={table.table} data-testid="differences">
        <Table.Thead>
          <Table.Tr>
            <Table.Th>Setting</Table.Th>
            {experiments.map((one) => (
              <Table.Th key={one.id}>
                <Group gap={8} wrap="nowrap">
                  <ExperimentSwatch id={one.id} looks={looks} />
                  {one.name}
                </Group>
              </Table.Th>
            ))}
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {differences.map(({ path, values, left_out }) => (
            <Table.Tr key={path}>
              <Table.Td title={path}>
                <SettingName
                  labels={
                    form.data
                      ? labelsOf(form.data.schema as Schema, ['training', ...path.split('.')])
                      : [path]
                  }
                />
              </Table.Td>
              {experiments.map((one, index) => (
                <Table.Td key={one.id} className={ui.number} fw={left_out[index] ? undefined : 550}>
                  {left_out[index] ? <span className={ui.quiet}>left out</span> : settingText(values[index])}
                </Table.Td>
              ))}
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  )
}

/** "Network, Hidden layers": the setting, with the innermost heading that it stands under. */
function SettingName({ labels }: { labels: readonly string[] }) {
  const name = labels.at(-1)
  const heading = labels.slice(1, -1).at(-1)
  return (
    <>
      {name}
      {heading && <span className={`${ui.quiet} ${ui.aside}`}>{heading}</span>}
    </>
  )
}
