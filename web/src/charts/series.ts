/** From the server's series to what the chart draws: one shared x, gaps as null, smoothing. */

export type Values = readonly (number | null)[]

/** A line of a chart; `band` is drawn in its colour behind it. */
export interface Line {
  key: string
  /** Absent for lines that the legend leaves out (single seeds). */
  label?: string
  /** Index into the palette. */
  color: number
  /** Index into the dashes; a line is drawn through without it. */
  dash?: number
  /** `thin` lines stand back: a seed behind its mean. */
  thin?: boolean
  values: Values
  band?: { low: Values; high: Values }
}

/** Lines over one x; every array is as long as `x`. */
export interface ChartData {
  x: readonly number[]
  lines: readonly Line[]
}

export interface Series {
  steps: readonly number[]
  values: readonly (number | null)[]
}

/** Puts series with steps of their own on the sorted union of their steps; where a series has no point stands null. */
export function alignSeries(series: readonly Series[]): { x: number[]; values: (number | null)[][] } {
  const x = [...new Set(series.flatMap((one) => one.steps))].sort((a, b) => a - b)
  const place = new Map(x.map((step, index) => [step, index]))
  const values = series.map((one) => {
    const row: (number | null)[] = new Array(x.length).fill(null)
    one.steps.forEach((step, index) => {
      const at = place.get(step)
      if (at !== undefined) row[at] = one.values[index] ?? null
    })
    return row
  })
  return { x, values }
}

/**
 * Exponential moving average with the start-up bias removed (as in Adam), so that the first points are not pulled to
 * zero. Nulls stay null and don't move the average. `weight` is the share of the past, 0 (off) to below 1.
 */
export function smooth(values: Values, weight: number): (number | null)[] {
  if (weight === 0) return [...values]
  let average = 0
  let norm = 0
  return values.map((value) => {
    if (value === null || !Number.isFinite(value)) return null
    average = weight * average + (1 - weight) * value
    norm = weight * norm + (1 - weight)
    return average / norm
  })
}

/** Lines smoothed by `weight`, and beneath each that the legend names its raw values, thin. */
export function smoothed({ x, lines }: ChartData, weight: number): ChartData {
  if (weight === 0) return { x, lines }
  return {
    x,
    lines: lines.flatMap((line) => {
      const { band, ...own } = line
      const soft = { ...own, values: smooth(line.values, weight) }
      if (line.thin || line.label === undefined) return [soft]
      const { label: _, ...raw } = own
      return [{ ...raw, key: `${line.key}:raw`, thin: true }, soft]
    }),
  }
}

/** The last number of a series, or null. */
export function lastValue(values: Values): number | null {
  for (let index = values.length - 1; index >= 0; index--) {
    const value = values[index]
    if (value !== null && value !== undefined) return value
  }
  return null
}

/**
 * The value at `index`, or else the nearest one before it: what a legend shows where a sparse series has no point. Beyond the
 * last one there is none.
 */
export function valueAt(values: Values, index: number): number | null {
  let last = values.length - 1
  while (last >= 0 && (values[last] ?? null) === null) last--
  if (index > last) return null
  for (let at = Math.min(index, values.length - 1); at >= 0; at--) {
    const value = values[at]
    if (value !== null && value !== undefined) return value
  }
  return null
}

/** Whether a logarithmic axis can show every value. */
export function allPositive(lines: readonly Line[]): boolean {
  return lines.every((line) => line.values.every((value) => value === null || value > 0))
}

/** What a logarithmic axis of x has a place for: all that lies above 0. */
export function aboveZero({ x, lines }: ChartData): ChartData {
  const from = x.findIndex((at) => at > 0)
  if (from === 0) return { x, lines }
  const cut = (values: Values) => (from < 0 ? [] : values.slice(from))
  return {
    x: from < 0 ? [] : x.slice(from),
    lines: lines.map(({ band, ...line }) => ({
      ...line,
      values: cut(line.values),
      ...(band ? { band: { low: cut(band.low), high: cut(band.high) } } : {}),
    })),
  }
}
