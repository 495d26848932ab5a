/** A titled chart with its own smoothing and axis, in the manner of every curve on the pages. */
import { Checkbox, Group, Slider, Title } from '@mantine/core'
import { type ReactNode, useMemo, useState } from 'react'
import { compact } from '../lib/format'
import { lazily } from '../lib/lazily'
import { type Horizontal, STEPS } from './axis'
import { ChartExport } from './ChartExport'
import { useLinkedCharts } from './LinkedCharts'
import classes from './MetricChart.module.css'
import { type ChartData, smoothed, within, withoutLines } from './series'
import { type HiddenLines, type LogSwitch, MOST_SMOOTHING, type SmoothSwitch } from './view'

/** Above and below a plot, about: what its values are, and the legend. */
const AROUND_PX = 16 + 24
/** Asked for at once, but nothing waits for it: the page is there before its charts. */
const code = import('./Chart')
const Chart = lazily(async () => (await code).Chart)

interface MetricChartProps {
  title: string
  note?: string
  data: ChartData
  /** What the values are, with their unit. */
  y: string
  format?: (value: number) => string
  yRange?: readonly [number, number]
  /** Whether smoothing makes sense: not for a handful of evaluations. */
  smoothable?: boolean
  /** Whether y is logarithmic, where that is offered. */
  log?: LogSwitch
  /** How much it is smoothed where somebody keeps it; else the chart keeps it itself. */
  smooth?: SmoothSwitch
  /** The same of the lines that are hidden. */
  lines?: HiddenLines
  /** Whether x is. */
  logX?: boolean
  height?: number
  /** Steps of the environment without it. */
  x?: Horizontal
  /** Whether the legend has the last values while nobody points: not where a curve always ends at the same one. */
  readsLast?: boolean
  /** A line below: what has to be known to read it. */
  foot?: string | null
  /** What stands in place of the curve while it has no point. */
  empty?: ReactNode
}

export function MetricChart({
  title,
  note,
  data,
  y,
  smoothable = false,
  smooth,
  lines,
  log,
  logX = false,
  height = 220,
  foot = null,
  empty = 'No value yet',
  format = compact,
  x = STEPS,
  ...rest
}: MetricChartProps) {
  const [own, setOwn] = useState(0)
  const [dragged, setDragged] = useState<number | null>(null)
  const range = useLinkedCharts()?.range ?? null
  const strength = smoothable ? (dragged ?? smooth?.strength ?? own) : 0
  const kept = smooth?.set ?? setOwn
  const pictured = (all: ChartData) => {
    const left = withoutLines(all, lines?.keys ?? [])
    return range ? within(left, range) : left
  }
  const shown = useMemo(() => smoothed(data, strength), [data, strength])
  return (
    <div className={classes.metric}>
      <div className={classes.head}>
        <Title order={3} className={classes.title} title={note && `${title}, ${note}`}>
          {title}
          {note && <span className={classes.note}>{note}</span>}
        </Title>
        <Group gap="sm" wrap="nowrap">
          {smoothable && (
            <div className={classes.smoothing}>
              <span aria-hidden>Smoothing</span>
              <Slider
                size="xs"
                w={72}
                min={0}
                max={MOST_SMOOTHING}
                step={0.01}
                value={strength}
                onChange={setDragged}
                onChangeEnd={(next) => {
                  setDragged(null)
                  kept(next)
                }}
                label={(value) => value.toFixed(2)}
                thumbLabel={`Smoothing of ${title}${note ? `, ${note}` : ''}`}
              />
            </div>
          )}
          {log && (
            <Checkbox
              size="xs"
              label="Log"
              aria-label={`Log axis of ${note ? `${title}, ${note}` : title}`}
              checked={log.on}
              onChange={(event) => log.set(event.currentTarget.checked)}
            />
          )}
          {data.x.length > 0 && (
            <ChartExport
              data={pictured(shown)}
              numbers={data}
              note={strength > 0 ? `smoothed, ${strength.toFixed(2)}` : undefined}
              title={note ? `${title}, ${note}` : title}
              format={format}
              x={x}
              y={y}
              yRange={rest.yRange}
              logarithmic={log?.on ?? false}
              logX={logX}
            />
          )}
        </Group>
      </div>
      {data.x.length === 0 ? (
        <div className={classes.empty} style={{ height: height + AROUND_PX }}>
          {empty}
        </div>
      ) : (
        <Chart
          meanwhile={<div style={{ height: height + AROUND_PX }} />}
          data={shown}
          label={title}
          y={y}
          logarithmic={log?.on ?? false}
          logX={logX}
          lines={lines}
          height={height}
          format={format}
          x={x}
          {...rest}
        />
      )}
      {foot && <p className={classes.foot}>{foot}</p>}
    </div>
  )
}
