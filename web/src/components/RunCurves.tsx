/** The curves of one run: the main ones, all others by section, and any metric as a panel of one's own. */
import { Group, Stack, Tabs, VisuallyHidden } from '@mantine/core'
import { memo, useDeferredValue, useMemo } from 'react'
import type { RunDetail, Series } from '../api/types'
import { ACROSS, placed } from '../charts/across'
import { curvesOf, useCurves } from '../charts/following'
import { MetricChart } from '../charts/MetricChart'
import grid from '../charts/MetricChart.module.css'
import { axisOf, type ChartSpec, MAIN_CHARTS, nameOf, SECTIONS } from '../charts/metrics'
import { lookOf, PANELS_AT_ONCE, USUAL_PANELS } from '../charts/panels'
import { chartOf } from '../charts/shape'
import { type ChangeView, type ChartView, hiddenOf, logOf, smoothOfChart, useChartView } from '../charts/view'
import { wordsOf } from '../charts/words'
import { Below } from './Below'
import { ChartControls } from './ChartControls'
import { PanelsButton } from './PanelsButton'
import classes from './RunCurves.module.css'
import { Panel } from './ui'

const POINTS = 600
const NO_SERIES: readonly Series[] = []
const CHOSEN = 'Chosen'
/** About what a chart is high. */
const CHART_PX = 270

export interface RunCurves {
  /** Over what x is. */
  series: readonly Series[]
  /** Every metric's name. */
  reported: readonly string[]
  view: ChartView
  /** The view in which the charts are drawn, which comes a moment later. */
  shown: ChartView
  onView: ChangeView
  /** What stands in place of a curve without points. */
  empty: string
}

/** What `useRunCurves` asks, for whoever knows the run before there is anything to draw. */
export const runCurves = (runId: string) => curvesOf(runId, POINTS)

export function useRunCurves(run: RunDetail): RunCurves {
  const metrics = useCurves(run.id, POINTS)
  const [view, onView] = useChartView()
  const shown = useDeferredValue(view)
  const { across } = shown
  const all = metrics.data?.series ?? NO_SERIES
  const series = useMemo(() => placed(all, across), [all, across])
  const reported = useMemo(() => all.map(({ name }) => name), [all])
  const uncounted = series === null && all.length > 0
  const empty =
    run.state === 'queued'
      ? 'Curves start with the training'
      : metrics.isPending
        ? ''
        : uncounted
          ? `${ACROSS[across].label} was not counted when this run trained`
          : 'No value yet'
  return { series: series ?? NO_SERIES, reported, view, shown, onView, empty }
}

export function MainCurves({ curves }: { curves: RunCurves }) {
  return (
    <Panel data-testid="main-curves">
      <VisuallyHidden component="h2">Main curves</VisuallyHidden>
      <Stack gap="md">
        <ChartControls {...curves} />
        {MAIN_CHARTS.map((spec) => (
          <Below key={spec.title} height={CHART_PX}>
            <SpecChart spec={spec} height={214} curves={curves} />
          </Below>
        ))}
      </Stack>
    </Panel>
  )
}

export function AllCurves({ curves }: { curves: RunCurves }) {
  const { view, shown, onView, reported } = curves
  return (
    <Panel title="Curves" actions={<ChartControls {...curves} />}>
      <Tabs defaultValue={view.panels === null ? (SECTIONS[0]?.title ?? CHOSEN) : CHOSEN} keepMounted={false}>
        <Tabs.List mb="md" className={classes.tabs}>
          {[...SECTIONS.map(({ title }) => title), CHOSEN].map((title) => (
            <Tabs.Tab key={title} value={title}>
              {title}
            </Tabs.Tab>
          ))}
        </Tabs.List>
        {SECTIONS.map(({ title, charts }) => (
          <Tabs.Panel key={title} value={title}>
            <div className={grid.grid}>
              {charts.map((spec) => (
                <Below key={nameOf(spec)} height={CHART_PX}>
                  <SpecChart spec={spec} height={180} curves={curves} />
                </Below>
              ))}
            </div>
          </Tabs.Panel>
        ))}
        <Tabs.Panel value={CHOSEN}>
          <Group justify="flex-end" mb="sm">
            <PanelsButton view={view} onView={onView} names={reported} />
          </Group>
          <div className={grid.grid}>
            {(shown.panels ?? USUAL_PANELS).map((name, place) => (
              <Below key={name} height={CHART_PX} waits={place >= PANELS_AT_ONCE}>
                <OwnChart name={name} curves={curves} />
              </Below>
            ))}
          </div>
        </Tabs.Panel>
      </Tabs>
    </Panel>
  )
}

function OwnChart({ name, curves }: { name: string; curves: RunCurves }) {
  const spec = useMemo(() => ({ ...lookOf(name), metrics: [{ name, label: wordsOf(name).title }] }), [name])
  return <SpecChart spec={spec} height={180} curves={curves} />
}

interface SpecChartProps {
  spec: ChartSpec
  height: number
  curves: RunCurves
}

function SpecChart({ spec, height, curves: { series, shown, onView, empty } }: SpecChartProps) {
  return <Drawn {...{ spec, height, series, onView, empty }} view={shown} />
}

type DrawnProps = Pick<RunCurves, 'series' | 'view' | 'onView' | 'empty'> & Omit<SpecChartProps, 'curves'>

const Drawn = memo(function Drawn({ spec, height, series, view, onView, empty }: DrawnProps) {
  const data = useMemo(() => chartOf(spec, series), [spec, series])
  const { metrics: _, prefix: __, ...look } = spec
  return (
    <MetricChart
      {...look}
      y={axisOf(spec)}
      data={data}
      x={ACROSS[view.across]}
      logX={view.logX}
      log={logOf(view, onView, nameOf(spec))}
      smooth={smoothOfChart(view, onView, nameOf(spec))}
      lines={hiddenOf(view, onView)}
      height={height}
      empty={empty}
    />
  )
})
