/** From the server's series to what the chart draws: one shared x, gaps as null, smoothing. */

export type Values = readonly (number | null)[]

/** A line of a chart; `band` is drawn in its colour behind it. */
export interface Line {
  key: string
  /** Absent for lines that the legend leaves out (single seeds). */
  label?: string
  /** Among numbers, where the legend leaves it out. */
  name?: string
  /** Index into the palette. */
  color: number
  /** Index into the dashes; a line is drawn through without it. */
  dash?: number
  /** `thin` lines stand back: a seed behind its mean. */
  thin?: boolean
  /** `faint` lines lie beneath all others: what was reported, where what is drawn is smoothed. */
  faint?: boolean
  values: Values
  /** What was reported, where `values` are smoothed: what is read is always that. */
  raw?: Values
  /** Where on x a mean ends, though some of its seeds go on. */
  until?: number
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

/** Lines smoothed by `weight`, and beneath each its raw values: thin, or faint beneath a thin one. */
export function smoothed({ x, lines }: ChartData, weight: number): ChartData {
  if (weight === 0) return { x, lines }
  return {
    x,
    lines: lines.flatMap((line) => {
      const { band, ...own } = line
      const soft = { ...own, values: smooth(line.values, weight), raw: line.values }
      const { label: _, name: __, ...raw } = own
      return [{ ...raw, key: `${line.key}:raw`, thin: true, ...(line.thin ? { faint: true } : {}) }, soft]
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
 * What a legend reads at a place on x: the point nearest to it of those that are `seen`. Before the curve's first point and
 * after its last there is none, but for what is as good as pointed at: `near`.
 */
export function readAt(
  x: readonly number[],
  values: Values,
  place: number,
  seen: readonly [number, number],
  near: readonly [number, number] = [place, place],
): number | null {
  let nearest = -1
  let [begun, ended] = [false, true]
  x.forEach((at, index) => {
    if ((values[index] ?? null) === null) return
    if (at <= place) begun = true
    ended = at < place
    if (at < seen[0] || at > seen[1]) return
    if (nearest < 0 || Math.abs(at - place) < Math.abs((x[nearest] ?? 0) - place)) nearest = index
  })
  const at = x[nearest]
  if (at === undefined) return null
  const within = (begun && !ended) || (at >= near[0] && at <= near[1])
  return within ? (values[nearest] ?? null) : null
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
      ...(line.raw ? { raw: cut(line.raw) } : {}),
      ...(band ? { band: { low: cut(band.low), high: cut(band.high) } } : {}),
    })),
  }
}

/** What is drawn where some lines are hidden by their entries in the legend: with each go its seeds and its raw values. */
export function withoutLines({ x, lines }: ChartData, hidden: readonly string[]): ChartData {
  const isOf = (line: Line, key: string) => line.key === key || line.key.startsWith(`${key}:`)
  return { x, lines: lines.filter((line) => !hidden.some((key) => isOf(line, key))) }
}

/** What lies within a range of x. */
export function within({ x, lines }: ChartData, [from, to]: readonly [number, number]): ChartData {
  const cut = (values: Values) =>
    values.filter((_, index) => (x[index] ?? from - 1) >= from && (x[index] ?? 0) <= to)
  return {
    x: x.filter((at) => at >= from && at <= to),
    lines: lines.map(({ band, ...line }) => ({
      ...line,
      values: cut(line.values),
      ...(band ? { band: { low: cut(band.low), high: cut(band.high) } } : {}),
    })),
  }
}
