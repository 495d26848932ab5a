/** Axes of charts: what x is and, where they are drawn point by point, where a value lies and which ticks there are. */
import { count, MINUS, NARROW_SPACE } from '../lib/format'

export interface Axis {
  /** Where a value lies, 0 to 1. */
  place: (value: unknown) => number
  ticks: readonly { at: number; label: string }[]
}

/** What x is, and how it is written. */
export interface Horizontal {
  /** Of the axis. */
  title: string
  format: (value: number) => string
  /** Of its column among numbers, where that has to say more. */
  column?: string
  /** What may lie between two ticks, ascending; without them any round number. */
  rounds?: readonly number[]
}

export const STEPS: Horizontal = { title: 'Steps', format: count }

/** Beyond this many, ticks would run into one another. */
const TICKS = 5

/** A factor: one value alone has an axis, too. */
const LEAST_ROOM = 1.01

/** Ticks are round numbers: "75.0 %" -> "75 %". */
export const roundTick = (text: string): string => text.replace(/\.0(?!\d)/, '')

/** A number as the pages write it: digits, a power of ten, a unit. */
const WRITTEN = new RegExp(`^(${MINUS}?\\d+(?:${NARROW_SPACE}\\d{3})*(?:\\.\\d+)?)(e${MINUS}?\\d+)?(\\D*)$`)
/** What has been rounded in the third digit is still seen to be a power of ten times another; a minute, an hour and a day are not. */
const ROUNDED = 0.01
const MOST_DECIMALS = 12
/** From five digits on they stand in threes. */
const IN_THREES = 1e4

/**
 * The ticks of a linear axis, all in the unit of the largest and with as many decimals: "0.00", "0.25", "0.50"; "0", "0.5k",
 * "1.0k". Where they are no numbers with one unit, each is as `format` has it.
 */
export function alike(ticks: readonly number[], format: (value: number) => string): string[] {
  const scale = scaleOf(ticks, format)
  if (!scale) return ticks.map(format)
  const { factor, unit } = scale
  const values = ticks.map((tick) => tick / factor)
  const gap = Math.min(...values.slice(1).map((value, index) => Math.abs(value - (values[index] ?? 0))))
  const near = 1e-6 * (Number.isFinite(gap) ? gap : Math.abs(values[0] ?? 1))
  let decimals = 0
  const isExact = (value: number) => Math.abs(value - Number(value.toFixed(decimals))) <= near
  while (decimals < MOST_DECIMALS && !values.every(isExact)) decimals++
  const inThrees = values.some((value) => Math.abs(value) >= IN_THREES)
  return values.map((value) => {
    const text = Math.abs(value).toFixed(decimals)
    if (Number(text) === 0 && factor !== 1 && !unit.endsWith('%')) return '0'
    const [whole = '', part] = text.split('.')
    const digits = inThrees ? count(Number(whole)) : whole
    const sign = value < 0 && Number(text) !== 0 ? MINUS : ''
    return `${sign}${part === undefined ? digits : `${digits}.${part}`}${unit}`
  })
}

/** The unit of the largest tick of which it is a number, and what it is worth. */
function scaleOf(
  ticks: readonly number[],
  format: (value: number) => string,
): { factor: number; unit: string } | null {
  for (const tick of [...ticks].sort((a, b) => Math.abs(b) - Math.abs(a))) {
    const [, digits = '', power = '', unit = ''] = WRITTEN.exec(format(tick)) ?? []
    const worth = Math.log10(tick / Number(digits.replaceAll(NARROW_SPACE, '').replace(MINUS, '-')))
    if (Math.abs(worth - Math.round(worth)) < ROUNDED)
      return { factor: 10 ** Math.round(worth), unit: power + unit }
  }
  return null
}

/** Steps of round numbers. */
const ROUND = [1, 2, 5, 10]

/** An axis of numbers that holds all of `values`; logarithmic where asked for and all are on one side of 0. */
export function numbers(
  values: readonly number[],
  format: (value: number) => string,
  { log = false, from, to }: { log?: boolean; from?: number; to?: number } = {},
): Axis {
  const low = from ?? Math.min(...values)
  const high = to ?? Math.max(...values)
  if (!Number.isFinite(low) || !Number.isFinite(high)) return { place: () => 0.5, ticks: [] }
  if (low === high) return { place: () => 0.5, ticks: [{ at: 0.5, label: format(low) }] }
  const isLog = log && low * high > 0
  const side = Math.sign(low)
  // Below 0 it is the amount that counts, the largest first.
  const on = (value: number) => (isLog ? side * Math.log10(side * value) : value)
  const place = (value: unknown) => (on(Number(value)) - on(low)) / (on(high) - on(low))
  const marks = !isLog
    ? rounds(low, high)
    : side > 0
      ? factors(low, high)
      : factors(-high, -low).map((amount) => -amount)
  const labels = isLog ? marks.map((mark) => roundTick(format(mark))) : alike(marks, format)
  return { place, ticks: marks.map((mark, index) => ({ at: place(mark), label: labels[index] ?? '' })) }
}

/** An axis of choices, in their order. */
export function choices(values: readonly unknown[], label: (value: unknown) => string): Axis {
  const at = (index: number) => (index + 0.5) / values.length
  // Lists of numbers are choices, too, and each trial brings its own.
  const texts = values.map((value) => JSON.stringify(value))
  return {
    place: (value) => at(Math.max(0, texts.indexOf(JSON.stringify(value)))),
    ticks: values.map((value, index) => ({ at: at(index), label: label(value) })),
  }
}

/** Round numbers from `low` to `high`, a few of them, as far apart as one of `steps` if there are some. */
export function rounds(low: number, high: number, steps: readonly number[] = []): number[] {
  const rough = (high - low) / TICKS
  const power = 10 ** Math.floor(Math.log10(rough))
  const step = steps.find((one) => one >= rough) ?? (ROUND.find((one) => one * power >= rough) ?? 10) * power
  const first = Math.ceil(low / step - 1e-9)
  const last = Math.floor(high / step + 1e-9)
  return Array.from({ length: last - first + 1 }, (_, index) =>
    Number(((first + index) * step).toPrecision(12)),
  )
}

/** What a logarithmic axis shows of values from `low` to `high`: they fill it, but for a twentieth of their factor at either end. */
export function fitted(low: number, high: number): [number, number] {
  const room = Math.max((high / low) ** 0.05, LEAST_ROOM)
  return [low / room, high * room]
}

/** Powers of ten from `low` to `high`, a few of them; where there are fewer than two, those of 1, 2 and 5 times one, or what is round. */
export function factors(low: number, high: number): number[] {
  const found: number[] = []
  for (let power = Math.floor(Math.log10(low)); 10 ** power <= high * (1 + 1e-9); power++)
    for (const times of [1, 2, 5]) found.push(Number((times * 10 ** power).toPrecision(12)))
  const inside = found.filter((one) => one >= low * (1 - 1e-9) && one <= high * (1 + 1e-9))
  const powers = inside.filter((one) => Number.isInteger(Math.round(Math.log10(one) * 1e6) / 1e6))
  if (powers.length < 2) return inside.length > 1 ? inside : high > low ? rounds(low, high) : [low]
  const every = Math.ceil(powers.length / (TICKS + 1))
  return powers.filter((_, index) => index % every === 0)
}
