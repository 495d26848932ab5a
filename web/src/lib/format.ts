/** Numbers, times and sizes as the pages write them. */

export const NARROW_SPACE = '\u202f'
export const MINUS = '\u2212'

/** 1234567 -> "1 234 567" with narrow spaces, which no locale reads as a decimal separator. */
export function count(value: number): string {
  const digits = Math.abs(Math.round(value))
    .toString()
    .replace(/\B(?=(\d{3})+(?!\d))/g, NARROW_SPACE)
  return Math.round(value) < 0 ? MINUS + digits : digits
}

/** 1234567 -> "1.23M": for axes and narrow columns. */
export function compact(value: number): string {
  const size = Math.abs(value)
  for (const [limit, suffix] of [
    [1e9, 'G'],
    [1e6, 'M'],
    [1e3, 'k'],
  ] as const)
    if (size >= limit) return `${significant(value / limit, 3)}${suffix}`
  return significant(value, 3)
}

/** At most `digits` significant digits, without trailing zeros: 0.01230 -> "0.0123". */
export function significant(value: number, digits = 4): string {
  if (!Number.isFinite(value)) return 'not a number'
  if (value === 0) return '0'
  const size = Math.abs(value)
  if (size < 1e-4) {
    const text = value.toExponential(digits - 2).replace(/\.?0+e/, 'e')
    return text.replaceAll('-', MINUS)
  }
  if (size >= 10 ** digits) return count(value)
  return Number(value.toPrecision(digits)).toString().replace('-', MINUS)
}

/** 0.9842 -> "98.4 %"; 1 -> "100 %". The last digit says what a few hundred episodes can tell apart. */
export function percent(fraction: number): string {
  const value = fraction * 100
  const text = value === 0 || value === 100 ? value.toFixed(0) : Math.min(99.9, value).toFixed(1)
  return `${text}${NARROW_SPACE}%`
}

/** The ends of an interval of fractions: "97.1–99.4 %". */
export function percentRange(low: number, high: number): string {
  const end = (fraction: number) => percent(fraction).replace(`${NARROW_SPACE}%`, '')
  return `${end(low)}–${end(high)}${NARROW_SPACE}%`
}

/** Seconds -> "45 s", "3 min 20 s", "2 h 5 min", "3 d 4 h". */
export function duration(seconds: number): string {
  const whole = Math.max(0, Math.round(seconds))
  if (whole < 60) return `${whole} s`
  const [minutes, hours, days] = [
    Math.floor(whole / 60),
    Math.floor(whole / 3600),
    Math.floor(whole / 86_400),
  ]
  if (minutes < 10 && whole % 60) return `${minutes} min ${whole % 60} s`
  if (minutes < 60) return `${minutes} min`
  if (hours < 24) return minutes % 60 ? `${hours} h ${minutes % 60} min` : `${hours} h`
  return hours % 24 ? `${days} d ${hours % 24} h` : `${days} d`
}

/** Epoch seconds, seen from `now` (epoch seconds too) -> "just now", "5 min ago", "3 h ago", "12 d ago". */
export function age(at: number, now: number): string {
  const seconds = now - at
  if (seconds < 45) return 'just now'
  if (seconds < 3600) return `${Math.max(1, Math.round(seconds / 60))} min ago`
  if (seconds < 86_400) return `${Math.round(seconds / 3600)} h ago`
  return `${Math.round(seconds / 86_400)} d ago`
}

/** Epoch seconds -> "2026-11-21 14:05:09" in the reader's time zone. */
export function dateTime(at: number): string {
  const time = new Date(at * 1000)
  const two = (part: number) => part.toString().padStart(2, '0')
  const date = `${time.getFullYear()}-${two(time.getMonth() + 1)}-${two(time.getDate())}`
  return `${date} ${two(time.getHours())}:${two(time.getMinutes())}:${two(time.getSeconds())}`
}

/** Bytes -> "512 B", "48.2 kB", "1.3 MB" (powers of 1000). */
export function fileSize(bytes: number): string {
  for (const [limit, unit] of [
    [1e9, 'GB'],
    [1e6, 'MB'],
    [1e3, 'kB'],
  ] as const)
    if (bytes >= limit) return `${significant(bytes / limit, 3)} ${unit}`
  return `${bytes} B`
}

/** "1 seed", "5 seeds". */
export function plural(n: number, noun: string): string {
  return `${count(n)} ${noun}${n === 1 ? '' : 's'}`
}

const SPELLED: Record<string, string> = {
  cpu: 'CPU',
  cuda: 'CUDA',
  ddpg: 'DDPG',
  lidar: 'LiDAR',
  mlp: 'MLP',
  ppo: 'PPO',
  relu: 'ReLU',
  resblock: 'ResBlock',
  sac: 'SAC',
  td3: 'TD3',
}

/** An identifier as a person reads it: "learning_rate" -> "Learning rate", "cpu" -> "CPU", "resblock" -> "ResBlock". */
export function words(identifier: string): string {
  const text = identifier.replaceAll('_', ' ')
  return SPELLED[text] ?? text.charAt(0).toUpperCase() + text.slice(1)
}

/** "0.034", "below 0.001": a probability that chance alone is as lopsided. */
export function pValue(p: number): string {
  return p < 0.001 ? 'below 0.001' : significant(p, 2)
}

/** "= 0.034", "below 0.001": as it stands behind a p. */
export function pIs(p: number): string {
  return p < 0.001 ? pValue(p) : `= ${pValue(p)}`
}
