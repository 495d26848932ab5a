/** A line chart on uPlot with a legend that reads the values under the cursor, in both colour schemes. */
import { useComputedColorScheme } from '@mantine/core'
import { type CSSProperties, useEffect, useMemo, useRef } from 'react'
import uPlot from 'uplot'
import 'uplot/dist/uPlot.min.css'
import { compact, count } from '../lib/format'
import { roundTick } from './axis'
import classes from './Chart.module.css'
import { lineColor } from './palette'
import { type ChartData, type Line, lastValue, valueAt } from './series'

const HEIGHT = 220
const AXIS_FONT = '11px system-ui, sans-serif'
const THIN_ALPHA = 0.38
const BAND_ALPHA = 0.14

interface ChartProps {
  data: ChartData
  /** What the chart shows, for the legend of screen readers. */
  label: string
  format?: (value: number) => string
  /** Fixed ends of the y axis; without them it follows the data. */
  yRange?: readonly [number, number]
  logarithmic?: boolean
  height?: number
  /** What x is, and how it is written. */
  xTitle?: string
  xFormat?: (value: number) => string
}

/** Draws `data`. Drag to zoom in, double-click to zoom out. */
export function Chart({
  data,
  label,
  format = compact,
  yRange,
  logarithmic = false,
  height = HEIGHT,
  xTitle = 'Steps',
  xFormat = count,
}: ChartProps) {
  const dark = useComputedColorScheme('light') === 'dark'
  const frame = useRef<HTMLDivElement>(null)
  const plot = useRef<uPlot | null>(null)
  const readout = useRef<(index: number | null) => void>(() => {})
  const labelled = data.lines.filter((line) => line.label !== undefined)

  // A plot is made anew when its lines are others; new values of the same lines are only handed over.
  const structure = JSON.stringify([data.lines.map((line) => [line.key, line.color, line.thin, !!line.band])])
  const [low, high] = yRange ?? [undefined, undefined]
  const lines = useRef(data.lines)
  lines.current = data.lines
  const columns = useMemo(() => toColumns(data), [data])
  const newest = useRef(columns)
  newest.current = columns

  // biome-ignore lint/correctness/useExhaustiveDependencies: `structure` stands for the lines.
  useEffect(() => {
    const element = frame.current
    if (!element) return
    const made = new uPlot(
      {
        ...appearance(dark, format, xTitle, xFormat === count ? compact : xFormat),
        ...seriesOf(lines.current, dark),
        width: element.clientWidth,
        height,
        scales: {
          x: { time: false },
          y:
            low !== undefined && high !== undefined ? { range: [low, high] } : { distr: logarithmic ? 3 : 1 },
        },
        legend: { show: false },
        cursor: { y: false, drag: { x: true, y: false, setScale: true }, points: { size: 6 } },
        hooks: { setCursor: [(chart) => readout.current(chart.cursor.idx ?? null)] },
      },
      newest.current,
      element,
    )
    plot.current = made
    const observer = new ResizeObserver(() => made.setSize({ width: element.clientWidth, height }))
    observer.observe(element)
    return () => {
      observer.disconnect()
      made.destroy()
      plot.current = null
    }
  }, [structure, dark, low, high, logarithmic, height, format, xTitle, xFormat])

  useEffect(() => {
    plot.current?.setData(columns)
  }, [columns])

  const legend = useRef<HTMLDivElement>(null)
  readout.current = (index) => {
    const cells = legend.current?.querySelectorAll('dd')
    if (!cells) return
    labelled.forEach((line, at) => {
      const cell = cells[at]
      const value = index === null ? lastValue(line.values) : valueAt(line.values, index)
      if (cell) cell.textContent = value === null ? '–' : format(value)
    })
    const step = legend.current?.querySelector('[data-step]')
    if (step) step.textContent = index === null ? '' : `${xTitle} ${xFormat(data.x[index] ?? 0)}`
  }

  return (
    <figure
      className={classes.chart}
      aria-label={label}
      data-testid="chart"
      data-points={data.x.length}
      data-step={data.x.at(-1)}
    >
      <div ref={frame} style={{ height }} />
      <div ref={legend} className={classes.legend}>
        <dl>
          {labelled.map((line) => {
            const value = lastValue(line.values)
            return (
              <div key={line.key} className={classes.entry}>
                <dt style={{ '--line-color': lineColor(line.color, dark) } as CSSProperties}>{line.label}</dt>
                <dd>{value === null ? '–' : format(value)}</dd>
              </div>
            )
          })}
        </dl>
        <span data-step className={classes.step} />
      </div>
    </figure>
  )
}

function toColumns({ x, lines }: ChartData): uPlot.AlignedData {
  const columns: (number | null)[][] = [[...x]]
  for (const line of lines) {
    columns.push([...line.values])
    if (line.band) columns.push([...line.band.high], [...line.band.low])
  }
  return columns as uPlot.AlignedData
}

function seriesOf(lines: readonly Line[], dark: boolean): { series: uPlot.Series[]; bands: uPlot.Band[] } {
  const series: uPlot.Series[] = [{}]
  const bands: uPlot.Band[] = []
  for (const line of lines) {
    const color = lineColor(line.color, dark)
    series.push({
      stroke: line.thin ? withAlpha(color, THIN_ALPHA) : color,
      width: line.thin ? 1 : 2,
      spanGaps: true,
      points: { show: (chart, _index, from, to) => !line.thin && to - from < 2 && chart.data[0].length < 3 },
    })
    if (line.band) {
      const edge: uPlot.Series = { stroke: 'transparent', width: 0, spanGaps: true, points: { show: false } }
      bands.push({ series: [series.length, series.length + 1], fill: withAlpha(color, BAND_ALPHA) })
      series.push({ ...edge }, { ...edge })
    }
  }
  return { series, bands }
}

function withAlpha(hex: string, alpha: number): string {
  return `${hex}${Math.round(alpha * 255)
    .toString(16)
    .padStart(2, '0')}`
}

function appearance(
  dark: boolean,
  format: (value: number) => string,
  xTitle: string,
  xFormat: (value: number) => string,
): Pick<uPlot.Options, 'axes' | 'padding'> {
  const ink = dark ? '#97a1a9' : '#5d6870'
  const grid = { stroke: dark ? '#252b31' : '#eceff0', width: 1 }
  const axis: uPlot.Axis = { stroke: ink, font: AXIS_FONT, grid, ticks: { show: false } }
  return {
    padding: [10, 12, 0, 0],
    axes: [
      {
        ...axis,
        size: 26,
        gap: 6,
        label: xTitle,
        labelFont: AXIS_FONT,
        labelSize: 16,
        labelGap: 0,
        grid: { show: false },
        values: (_, ticks) => ticks.map((tick: number | null) => (tick === null ? '' : xFormat(tick))),
        space: 64,
      },
      {
        ...axis,
        size: 52,
        gap: 6,
        space: 34,
        // A logarithmic axis hands over null for the ticks that it leaves blank.
        values: (_, ticks) =>
          ticks.map((tick: number | null) => (tick === null ? '' : roundTick(format(tick)))),
      },
    ],
  }
}
