/** Values of settings in words. */
import { count, significant, words } from '../lib/format'

/** A value of a setting as text. */
export function settingText(value: unknown): string {
  if (value === null || value === undefined) return '–'
  if (typeof value === 'number') return Number.isInteger(value) ? count(value) : significant(value, 6)
  if (typeof value === 'boolean') return value ? 'yes' : 'no'
  // A name is spelled out, a formula is left as it was typed.
  if (typeof value === 'string') return /[^\w\s-]/.test(value) ? value : words(value)
  if (Array.isArray(value)) return value.map(settingText).join(', ') || 'none'
  return termText(value as Record<string, unknown>)
}

/** A term of a list in a few words: "Progress 500", "Proximity −5 (margin 0.3)". */
function termText({ name, label, weight, ...rest }: Record<string, unknown>): string {
  const more = Object.entries(rest)
    .filter(([, value]) => value !== false)
    .map(([key, value]) => (key === 'formula' ? String(value) : `${key} ${settingText(value)}`))
  const called = label ?? name
  const head = [
    called !== undefined && words(String(called)),
    weight !== undefined && weight !== null && settingText(weight),
  ]
    .filter(Boolean)
    .join(' ')
  const inside = more.join(', ')
  return head && inside ? `${head} (${inside})` : head || inside
}
