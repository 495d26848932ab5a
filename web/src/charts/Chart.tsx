/** A line chart on uPlot with a legend that reads the values under the cursor, in both colour schemes. */
import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useMemo, useRef, useState } from 'react'
import uPlot from 'uplot'
import 'uplot/dist/uPlot.min.css'
import { compact, count } from '../lib/format'
import { useInSight, useNear } from '../lib/near'
import { alike, factors, fitted, type Horizontal, roundTick, STEPS } from './axis'
import classes from './Chart.module.css'
import { useLinkedCharts } from './LinkedCharts'
import { dashes, lineColor } from './palette'
import { listenForPinch } from './pinch'
import { Swatch } from './Swatch'
import { aboveZero, allPositive, type ChartData, type Line, lastValue, readAt, withoutLines } from './series'
import type { HiddenLines } from './view'

const HEIGHT = 220
const STRIP = 150
const Y_AXIS = 52
const Y_GAP = 6
/** A digit's width, in the font of axes. */
const DIGIT = 6.2
const AXIS_FONT = '11px system-ui, sans-serif'
const THIN_ALPHA = 0.38
const FAINT_ALPHA = 0.14
const BAND_ALPHA = 0.14
/** A point so near to the cursor is pointed at. */
const NEAR_PX = 8
/** How uPlot calls a plot that has drawn itself. */
const READY = 1
/** How it calls what a scale is. */
const LINEAR = 1
const LOGARITHMIC = 3

interface ChartProps {
  data: ChartData
  /** What the chart shows, for the legend of screen readers. */
  label: string
  /** What its values are, with their unit, where nothing above it says so. */
  y?: string
  format?: (value: number) => string
  /** Fixed ends of the y axis; without them it follows the data. */
  yRange?: readonly [number, number]
  /** Where every value that is shown is above 0; else it says why not. */
  logarithmic?: boolean
  /** The same of x: what lies at 0 is left out. */
  logX?: boolean
  height?: number
  x?: Horizontal
  /** Whether the legend has the last values while nobody points. */
  readsLast?: boolean
  /** Lines that are hidden where somebody keeps it; else the chart keeps it itself. */
  lines?: HiddenLines | undefined
  /** Where on x the cursor stands; null leaves it to whoever points. */
  at?: number | null
  /** A click's x. */
  onSeek?: (x: number) => void
}

/**
 * Draws `data`. Drag across, or up and down, or pinch to zoom in; a button appears that zooms out. Charts within `LinkedCharts` share
 * their cursor and what they show of x. A name in the legend hides its lines and brings them back.
 */
export function Chart({
  data,
  label,
  y,
  format = compact,
  yRange,
  logarithmic: wanted = false,
  logX = false,
  height = HEIGHT,
  x = STEPS,
  readsLast = true,
  at = null,
  lines: kept,
  onSeek,
}: ChartProps) {
  const dark = useComputedColorScheme('light') === 'dark'
  const frame = useRef<HTMLDivElement>(null)
  const near = useNear(frame)
  const place = useRef(at)
  place.current = at
  const plot = useRef<uPlot | null>(null)
  const readout = useRef<(chart: uPlot) => void>(() => {})
  const linked = useLinkedCharts()
  const link = useRef(linked)
  link.current = linked
  const seek = useRef(onSeek)
  seek.current = onSeek
  const [zoomed, setZoomed] = useState(false)
  const [own, setOwn] = useState<readonly string[]>([])
  const { keys: hidden, set: setHidden } = kept ?? { keys: own, set: setOwn }
  const all = useMemo(() => (logX ? aboveZero(data) : data), [data, logX])
  const labelled = all.lines.filter((line) => line.label !== undefined)
  const drawn = useMemo(() => ({ ...withoutLines(all, hidden) }), [all, hidden])
  const logarithmic = useMemo(() => wanted && allPositive(drawn.lines), [wanted, drawn])

  // A plot is made anew when its lines are others; new values of the same lines are only handed over.
  const structure = JSON.stringify([
    drawn.lines.map((line) => [line.key, line.color, line.dash, line.thin, line.faint, !!line.band]),
  ])
  const [low, high] = yRange ?? [undefined, undefined]
  const lines = useRef(drawn.lines)
  lines.current = drawn.lines
  const columns = useMemo(() => toColumns(drawn), [drawn])
  const newest = useRef(columns)
  newest.current = columns

  // biome-ignore lint/correctness/useExhaustiveDependencies: `structure` stands for the lines.
  useEffect(() => {
    const element = frame.current
    if (!element || !near) return
    /** Two fingers choose what is shown of x. */
    const pinchable = (chart: uPlot) => {
      const inner = ([from, to]: readonly [number, number]): [number, number] =>
        logX ? [Math.log10(from), Math.log10(to)] : [from, to]
      const outer = ([from, to]: readonly [number, number]): [number, number] =>
        logX ? [10 ** from, 10 ** to] : [from, to]
      listenForPinch(chart.over, {
        shown: () => inner(rangeOf(chart)),
        all: () => inner([newest.current[0][0] ?? 0, newest.current[0].at(-1) ?? 0]),
        show: (range) => {
          if (!range) return zoomOut.current()
          const [min, max] = outer(range)
          setZoomed(true)
          chart.setScale('x', { min, max })
        },
        end: (range) => range && link.current?.zoomTo(outer(range)),
      })
    }
    const made = new uPlot(
      {
        // A strip among others says below what x is, where it reads its values.
        ...appearance({ dark, format, x, titled: height >= STRIP, logX, logarithmic }),
        ...seriesOf(lines.current, dark, logarithmic),
        width: element.clientWidth,
        height,
        scales: {
          x: logX
            ? {
                time: false,
                distr: LOGARITHMIC,
                range: (_, from, to) => (from < to ? [from, to] : fitted(from, to)),
              }
            : { time: false, distr: LINEAR },
          y: logarithmic
            ? { distr: LOGARITHMIC, range: (_, least, most) => fitted(least ?? 1, most ?? 1) }
            : low !== undefined && high !== undefined
              ? { range: [low, high] }
              : { distr: LINEAR },
        },
        legend: { show: false },
        cursor: {
          y: false,
          drag: { x: true, y: true, uni: 24, setScale: true },
          points: { size: 6 },
          bind: {
            dblclick: () => () => {
              zoomOut.current()
              return null
            },
          },
          // Their zooms are linked by the range, not by the mouse: y is every chart's own.
          ...(link.current
            ? {
                sync: {
                  key: link.current.key,
                  scales: ['x', null],
                  filters: { pub: (event) => event === 'mousemove' || event === 'mouseleave' },
                },
              }
            : {}),
        },
        hooks: {
          ready: [
            (chart) => {
              chart.over.addEventListener('click', () => {
                const left = chart.cursor.left ?? -1
                if (left >= 0) seek.current?.(chart.posToVal(left, 'x'))
              })
              pinchable(chart)
              // Its scales are known only now, and nothing may move the cursor again.
              putCursor(chart, place.current)
            },
          ],
          setCursor: [(chart) => readout.current(chart)],
          setSelect: [
            (chart) => {
              if (chart.select.width === 0 && chart.select.height === 0) return
              setZoomed(true)
              const { left, width } = chart.select
              // Up and down alone takes all of the width.
              if (width < chart.over.clientWidth - 1)
                link.current?.zoomTo([chart.posToVal(left, 'x'), chart.posToVal(left + width, 'x')])
            },
          ],
        },
      },
      newest.current,
      element,
    )
    plot.current = made
    drawnData.current = newest.current
    // What it was zoomed to has gone with the plot before it.
    setZoomed(false)
    const observer = new ResizeObserver(() => made.setSize({ width: element.clientWidth, height }))
    observer.observe(element)
    return () => {
      observer.disconnect()
      made.destroy()
      plot.current = null
    }
  }, [near, structure, dark, low, high, logarithmic, logX, height, format, x])

  const range = linked?.range ?? null
  const inside = useRef(false)
  inside.current = zoomed || range !== null
  const drawnData = useRef(columns)
  const drawNewest = () => {
    const chart = plot.current
    if (!chart || drawnData.current === newest.current) return
    drawnData.current = newest.current
    // Newer values leave a reader where he has zoomed to.
    chart.setData(newest.current, !inside.current)
    // A plot of this very moment draws itself; asked to, it would not know its ends yet, and show nothing.
    if (inside.current && chart.status === READY) chart.redraw()
  }
  const inSight = useInSight(frame, drawNewest)
  // biome-ignore lint/correctness/useExhaustiveDependencies: what is drawn anew is looked up, and only while one may see it.
  useEffect(() => {
    if (inSight.current) drawNewest()
  }, [columns])

  // biome-ignore lint/correctness/useExhaustiveDependencies: a plot that is made anew is shown what the others show.
  useEffect(() => {
    const chart = plot.current
    if (!chart || !linked) return
    const [from, to] = range ?? [all.x[0], all.x.at(-1)]
    // Of a single point uPlot knows better: between x and itself there is room for marks without end.
    if (from === undefined || to === undefined || from >= to) return
    const [shownFrom, shownTo] = rangeOf(chart)
    if (from === shownFrom && to === shownTo) return
    chart.setScale('x', { min: from, max: to })
  }, [near, range, structure, dark, logarithmic, logX])

  // biome-ignore lint/correctness/useExhaustiveDependencies: a plot that is made anew, or zoomed, has its cursor elsewhere.
  useEffect(() => {
    const chart = plot.current
    if (chart) putCursor(chart, at)
  }, [at, columns, structure, dark, range, zoomed])

  const zoomOut = useRef(() => {})
  zoomOut.current = () => {
    setZoomed(false)
    linked?.zoomTo(null)
    drawnData.current = newest.current
    plot.current?.setData(newest.current)
  }

  const written = (value: number | null) => (value === null ? '–' : format(value))
  const atRest = ({ values, raw = values, until }: Line) => {
    if (!readsLast) return ''
    const last = written(lastValue(raw))
    return until === undefined ? last : `${last} at ${x.format(until)}, where the first seed ends`
  }
  const legend = useRef<HTMLDListElement>(null)
  const where = useRef<HTMLSpanElement>(null)
  readout.current = (chart) => {
    const cells = legend.current?.querySelectorAll('dd')
    if (!cells) return
    const read = pointedAt(chart, linked !== null)
    labelled.forEach((line, at) => {
      const cell = cells[at]
      if (!cell) return
      const { place, seen, near } = read ?? {}
      if (place === undefined || !seen) cell.textContent = atRest(line)
      else cell.textContent = written(readAt(all.x, line.raw ?? line.values, place, seen, near))
    })
    const step = where.current
    if (step) step.textContent = read === null ? '' : `${x.title} ${x.format(read.place)}`
  }

  return (
    <figure
      className={classes.chart}
      aria-label={label}
      data-testid="chart"
      data-points={data.x.length}
      data-step={data.x.at(-1)}
    >
      {y && <div className={classes.axis}>{y}</div>}
      <div ref={frame} style={{ height }} />
      <div className={classes.below}>
        <dl ref={legend} className={classes.legend}>
          {labelled.map((line) => {
            const off = hidden.includes(line.key)
            return (
              <div key={line.key} className={classes.entry}>
                <dt>
                  <button
                    type="button"
                    className={classes.toggle}
                    aria-pressed={!off}
                    title={off ? 'Show' : 'Hide'}
                    onClick={() =>
                      setHidden(off ? hidden.filter((key) => key !== line.key) : [...hidden, line.key])
                    }
                  >
                    <Swatch color={line.color} dash={line.dash} />
                    {line.label}
                  </button>
                </dt>
                <dd>{atRest(line)}</dd>
              </div>
            )
          })}
        </dl>
        <span ref={where} className={classes.step} />
        {(zoomed || range !== null) && (
          <button type="button" className={classes.reset} onClick={() => zoomOut.current()}>
            Reset zoom
          </button>
        )}
        {wanted && !logarithmic && (
          <span className={classes.note}>
            Drawn linearly: a logarithmic axis has no place for values of 0 or below
          </span>
        )}
        {all.x.length < data.x.length && (
          <span className={classes.note}>What lies at 0 has no place on a logarithmic axis</span>
        )}
      </div>
    </figure>
  )
}

function isAlone(column: uPlot.AlignedData[number] | undefined): boolean {
  let found = 0
  for (const value of column ?? []) if (value !== null && value !== undefined && ++found > 1) return false
  return found === 1
}

function putCursor(chart: uPlot, at: number | null): void {
  if (at !== null) chart.setCursor({ left: chart.valToPos(at, 'x'), top: 0 })
}

/**
 * Where on x one points, what is seen of it, and what is as good as pointed at; null where nobody points. Linked charts have
 * one cursor and say its own place; another says that of the nearest point, if that is seen.
 */
function pointedAt(
  chart: uPlot,
  linked: boolean,
): { place: number; seen: [number, number]; near: [number, number] } | null {
  const { idx, left = -1 } = chart.cursor
  if (idx === null || idx === undefined || left < 0) return null
  const seen = rangeOf(chart)
  const near: [number, number] = [chart.posToVal(left - NEAR_PX, 'x'), chart.posToVal(left + NEAR_PX, 'x')]
  const nearest = chart.data[0][idx]
  if (linked || nearest === undefined || nearest < seen[0] || nearest > seen[1])
    return { place: chart.posToVal(left, 'x'), seen, near }
  return { place: nearest, seen, near }
}

function rangeOf(chart: uPlot): [number, number] {
  return [chart.scales.x?.min ?? 0, chart.scales.x?.max ?? 0]
}

function toColumns({ x, lines }: ChartData): uPlot.AlignedData {
  const columns: (number | null)[][] = [[...x]]
  for (const line of lines) {
    columns.push([...line.values])
    if (line.band) columns.push([...line.band.high], [...line.band.low])
  }
  return columns as uPlot.AlignedData
}

function seriesOf(
  lines: readonly Line[],
  dark: boolean,
  logarithmic: boolean,
): { series: uPlot.Series[]; bands: uPlot.Band[] } {
  const series: uPlot.Series[] = [{}]
  const bands: uPlot.Band[] = []
  for (const line of lines) {
    const color = lineColor(line.color, dark)
    series.push({
      stroke: line.thin ? withAlpha(color, line.faint ? FAINT_ALPHA : THIN_ALPHA) : color,
      width: line.thin ? 1 : 2,
      dash: dashes(line.dash ?? 0, line.thin ? 1 : 2),
      spanGaps: true,
      // One point is no line: it is drawn as what it is.
      points: { show: (chart, index) => isAlone(chart.data[index]) },
    })
    if (line.band) {
      const edge: uPlot.Series = {
        // An interval that reaches far below its mean would take most of a logarithmic axis.
        auto: !logarithmic,
        stroke: 'transparent',
        width: 0,
        spanGaps: true,
        points: { show: false },
      }
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

interface Appearance {
  dark: boolean
  format: (value: number) => string
  x: Horizontal
  /** Whether it says what x is. */
  titled: boolean
  logX: boolean
  logarithmic: boolean
}

/** Of a logarithmic axis: round numbers from end to end, and every one written as it is. */
const byFactors = (format: (value: number) => string): uPlot.Axis => ({
  splits: (_, __, from, to) => factors(from, to),
  filter: (_, ticks) => ticks,
  values: (_, ticks) => ticks.map((tick) => roundTick(format(tick))),
})

/** As wide as its ticks need, and never narrower than others: plots that stand one below the other begin at one place. */
function widthOf(_: uPlot, ticks: readonly string[] | null): number {
  const longest = Math.max(0, ...(ticks ?? []).map((tick) => tick.length))
  return Math.max(Y_AXIS, Math.ceil(longest * DIGIT) + 2 * Y_GAP)
}

function appearance({
  dark,
  format,
  x,
  titled,
  logX,
  logarithmic,
}: Appearance): Pick<uPlot.Options, 'axes' | 'padding'> {
  const ink = dark ? '#97a1a9' : '#5d6870'
  const grid = { stroke: dark ? '#252b31' : '#eceff0', width: 1 }
  // What is counted is short on the axis, and whole below it.
  const written = x.format === count ? compact : x.format
  const axis: uPlot.Axis = { stroke: ink, font: AXIS_FONT, grid, ticks: { show: false } }
  return {
    padding: [10, 12, 0, 0],
    axes: [
      {
        ...axis,
        size: 26,
        gap: 6,
        ...(titled ? { label: x.title } : {}),
        ...(x.rounds ? { incrs: [...x.rounds] } : {}),
        labelFont: AXIS_FONT,
        labelSize: 16,
        labelGap: 0,
        grid: { show: false },
        // Times are told in units of their own.
        values: (_, ticks) => (x.rounds ? ticks.map(written) : alike(ticks, written)),
        space: 64,
        ...(logX ? byFactors(written) : {}),
      },
      {
        ...axis,
        size: widthOf,
        gap: Y_GAP,
        space: 34,
        values: (_, ticks) => alike(ticks, format),
        ...(logarithmic ? byFactors(format) : {}),
      },
    ],
  }
}
