/** A chart as it leaves the page: SVG that needs nothing else, and the numbers as CSV. */
import { alike, factors, type Horizontal, rounds, roundTick } from './axis'
import { dashes, lineColor } from './palette'
import { aboveZero, allPositive, type ChartData, type Line, type Values } from './series'

export const WIDTH = 720
const HEIGHT = 360
const LEFT = 70
const RIGHT = 16
const TOP = 36
const BOTTOM = 48
const ROW = 18
/** Of the title of y: as long as its axis is. */
const MOST_LETTERS = 40
/** Of a line, in the legend: as long as shows its dashes. */
const SAMPLE = 28

export interface PictureOptions {
  title: string
  x: Horizontal
  /** What the values are, with their unit. */
  y: string
  format: (value: number) => string
  yRange?: readonly [number, number] | undefined
  /** What has to be known of the curves, behind the title. */
  note?: string | undefined
  /** Where every value is above 0. */
  logarithmic?: boolean
  /** The same of x: what lies at 0 is left out. */
  logX?: boolean
}

/** The chart in its light colours, with title, axes and legend; as high as `heightOf` says. */
export function svgOf(whole: ChartData, options: PictureOptions): string {
  const { title, note, x, y, format, yRange, logX = false } = options
  const data = logX ? aboveZero(whole) : whole
  const logarithmic = options.logarithmic === true && allPositive(data.lines)
  const bend = logarithmic ? Math.log10 : straight
  const bendX = logX ? Math.log10 : straight
  const [start, end] = [data.x[0] ?? 0, data.x.at(-1) ?? 0]
  // An interval that reaches far below its mean would take most of a logarithmic axis: it ends at the edge.
  const seen = data.lines.flatMap(({ values, band }) =>
    logarithmic ? values : [values, band?.low ?? [], band?.high ?? []].flat(),
  )
  const values = seen.filter((value): value is number => value !== null)
  const [low, high] = yRange && !logarithmic ? yRange : padded(values.map(bend))
  const along = scale(bendX(start), bendX(end), LEFT, WIDTH - RIGHT)
  const across = (value: number) => along(bendX(value))
  const rise = scale(low, high, HEIGHT - BOTTOM, TOP)
  const up = (value: number) => rise(logarithmic ? bend(Math.max(value, 10 ** low)) : value)
  const yTicks = logarithmic ? factors(10 ** low, 10 ** high) : ticks(low, high)
  const xTicks = logX && end > start ? factors(start, end) : ticks(start, end, x.rounds)
  const yTexts = logarithmic ? yTicks.map((tick) => roundTick(format(tick))) : alike(yTicks, format)
  const xTexts = logX || x.rounds ? xTicks.map(x.format) : alike(xTicks, x.format)
  const middle = (TOP + HEIGHT - BOTTOM) / 2
  const ink = 'fill="#3d464d"'
  const legend = data.lines.filter((line) => line.label !== undefined)
  return [
    `<svg xmlns="http://www.w3.org/2000/svg" width="${WIDTH}" height="${heightOf(data)}" viewBox="0 0 ${WIDTH} ${heightOf(data)}" font-family="system-ui, sans-serif" font-size="12">`,
    `<rect width="100%" height="100%" fill="#fff"/>`,
    `<text x="${LEFT}" y="20" font-size="14" font-weight="600" ${ink}>${escaped(title)}${note ? `<tspan font-size="12" font-weight="400"> · ${escaped(note)}</tspan>` : ''}</text>`,
    `<text transform="translate(16 ${middle}) rotate(-90)" text-anchor="middle" ${ink}>${escaped(shortened(y))}</text>`,
    ...yTicks.map(
      (tick, index) =>
        `<line x1="${LEFT}" x2="${WIDTH - RIGHT}" y1="${fixed(up(tick))}" y2="${fixed(up(tick))}" stroke="#e2e6e8"/><text x="${LEFT - 8}" y="${fixed(up(tick) + 4)}" text-anchor="end" ${ink}>${escaped(yTexts[index] ?? '')}</text>`,
    ),
    ...xTicks.map(
      (tick, index) =>
        `<text x="${fixed(across(tick))}" y="${HEIGHT - BOTTOM + 18}" text-anchor="middle" ${ink}>${escaped(xTexts[index] ?? '')}</text>`,
    ),
    `<text x="${(LEFT + WIDTH - RIGHT) / 2}" y="${HEIGHT - BOTTOM + 38}" text-anchor="middle" ${ink}>${escaped(x.title)}</text>`,
    ...data.lines.map((line) => curve(data.x, line, across, up)),
    ...legend.map((line, row) => {
      const top = HEIGHT + ROW * row
      return `<line x1="${LEFT}" x2="${LEFT + SAMPLE}" y1="${top + 4}" y2="${top + 4}" stroke="${lineColor(line.color, false)}" stroke-width="3"${dashed(line, 2)}/><text x="${LEFT + SAMPLE + 8}" y="${top + 8}" ${ink}>${escaped(line.label ?? '')}</text>`
    }),
    '</svg>',
  ].join('\n')
}

/** Pixels. */
export function heightOf(data: ChartData): number {
  return HEIGHT + ROW * data.lines.filter((line) => line.label !== undefined).length
}

/** A row for each x: every line, and the ends of its band. */
export function csvOf(data: ChartData, { title, column = title }: Horizontal): string {
  const columns: { head: string; values: Values }[] = data.lines.flatMap((line) => {
    const head = line.label ?? line.name ?? line.key
    const own = [{ head, values: line.values }]
    return line.band
      ? [
          ...own,
          { head: `${head}, low`, values: line.band.low },
          { head: `${head}, high`, values: line.band.high },
        ]
      : own
  })
  const rows = data.x.map((at, index) => [at, ...columns.map(({ values }) => values[index] ?? '')].join(','))
  return `${[[column, ...columns.map(({ head }) => head)].map(cell).join(','), ...rows].join('\r\n')}\r\n`
}

function curve(
  x: readonly number[],
  line: Line,
  across: (value: number) => number,
  up: (value: number) => number,
): string {
  const { thin, faint, values, band } = line
  const ink = lineColor(line.color, false)
  const points = (of: Values) =>
    x.flatMap((at, index) => {
      const value = of[index]
      const y = value === null || value === undefined ? Number.NaN : up(value)
      return Number.isFinite(y) ? [`${fixed(across(at))},${fixed(y)}`] : []
    })
  const edge = band ? [...points(band.high), ...points(band.low).reverse()] : []
  const area =
    edge.length > 0 ? `<polygon points="${edge.join(' ')}" fill="${ink}" fill-opacity="0.15"/>` : ''
  const [first, ...rest] = points(values)
  if (first !== undefined && rest.length === 0) {
    const [left, top] = first.split(',')
    return `${area}<circle cx="${left}" cy="${top}" r="3" fill="${ink}"/>`
  }
  const look = `${thin ? `stroke-width="1" stroke-opacity="${faint ? 0.15 : 0.4}"` : 'stroke-width="2"'}${dashed(line, thin ? 1 : 2)}`
  const drawn = [...(first === undefined ? [] : [first]), ...rest].join(' ')
  return `${area}<polyline points="${drawn}" fill="none" stroke="${ink}" ${look}/>`
}

function dashed({ dash = 0 }: Line, width: number): string {
  const lengths = dashes(dash, width)
  return lengths.length > 0 ? ` stroke-dasharray="${lengths.join(' ')}"` : ''
}

function scale(low: number, high: number, start: number, end: number): (value: number) => number {
  return (value) =>
    high === low ? (start + end) / 2 : start + ((value - low) / (high - low)) * (end - start)
}

function padded(values: readonly number[]): [number, number] {
  const low = values.reduce((least, value) => Math.min(least, value), Number.POSITIVE_INFINITY)
  const high = values.reduce((most, value) => Math.max(most, value), Number.NEGATIVE_INFINITY)
  if (!Number.isFinite(low)) return [0, 1]
  const room = (high - low) * 0.05 || Math.abs(high) * 0.05 || 1
  return [low - room, high + room]
}

/** Round numbers from low to high, about five. */
function ticks(low: number, high: number, steps?: readonly number[]): number[] {
  return high <= low ? [low] : rounds(low, high, steps)
}

const straight = (value: number) => value
const fixed = (value: number) => value.toFixed(1)

/** A metric without words is called by its name, which may be longer than the axis; the chart's title has all of it. */
const shortened = (text: string) =>
  text.length > MOST_LETTERS ? `${text.slice(0, MOST_LETTERS - 1)}…` : text

function escaped(text: string): string {
  return text.replaceAll('&', '&amp;').replaceAll('<', '&lt;').replaceAll('>', '&gt;')
}

/** A cell that no spreadsheet takes for a formula. */
function cell(text: string): string {
  const safe = /^[=+\-@\t\r]/.test(text) ? `'${text}` : text
  return `"${safe.replaceAll('"', '""')}"`
}
