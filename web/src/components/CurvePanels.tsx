/** The curves of experiments: the metrics that are looked at, each a chart, and how. */
import { Group, Text } from '@mantine/core'
import { useDeferredValue } from 'react'
import { LinkedCharts } from '../charts/LinkedCharts'
import charts from '../charts/MetricChart.module.css'
import { PANELS_AT_ONCE, USUAL_PANELS } from '../charts/panels'
import { sharedX, useChartView, useKeptZoom } from '../charts/view'
import { Below } from './Below'
import { ChartControls } from './ChartControls'
import { CurveChart, useReported } from './CurveChart'
import { PanelsButton } from './PanelsButton'
import { Panel } from './ui'

/** About what a chart is high. */
const CHART_PX = 310

export function CurvePanels({ experiments }: { experiments: readonly string[] }) {
  const [view, setView] = useChartView()
  // The controls show what was chosen while the charts are drawn.
  const shown = useDeferredValue(view)
  const kept = useKeptZoom(view, setView)
  const reported = useReported(experiments)
  return (
    <Panel
      title="Curves"
      actions={
        <Group gap="md">
          <Text size="xs" c="dimmed">
            thin: single seeds · bold: their mean · band: 95 % interval over seeds
          </Text>
          <ChartControls view={view} onView={setView} reported={reported} />
          <PanelsButton view={view} onView={setView} names={reported} />
        </Group>
      }
    >
      <LinkedCharts of={sharedX(shown)} kept={kept}>
        <div className={charts.grid}>
          {(shown.panels ?? USUAL_PANELS).map((name, place) => (
            <Below key={name} height={CHART_PX} waits={place >= PANELS_AT_ONCE}>
              <CurveChart name={name} experiments={experiments} view={shown} onView={setView} />
            </Below>
          ))}
        </div>
      </LinkedCharts>
    </Panel>
  )
}
