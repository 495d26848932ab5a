/** What rules are called on the page, and what came of their alerts. */
import type { Alert, AlertRule } from '../api/types'

export const EVENTS: { value: AlertRule['event']; label: string }[] = [
  { value: 'ended', label: 'A training has ended' },
  { value: 'failed', label: 'A run has failed' },
  { value: 'diagnosis', label: 'A diagnosis is found' },
  { value: 'success', label: 'Success reaches a rate' },
  { value: 'stuck', label: 'A run waits in the queue' },
  { value: 'disk', label: 'The disk is almost full' },
]

/** What a threshold counts, and where it begins; an event that is not here has none. */
export const THRESHOLDS: Partial<
  Record<AlertRule['event'], { label: string; start: number; min: number; max: number; scale: number }>
> = {
  success: { label: 'Success, %', start: 90, min: 0, max: 100, scale: 0.01 },
  stuck: { label: 'For minutes', start: 30, min: 1, max: 43_200, scale: 1 },
  disk: { label: 'GiB left', start: 10, min: 0.1, max: 1_000_000, scale: 1 },
}

export const CHANNELS: { value: AlertRule['channel']; label: string }[] = [
  { value: 'browser', label: 'this browser' },
  { value: 'webhook', label: 'a webhook' },
  { value: 'mail', label: 'mail' },
]

export const FORMATS: { value: AlertRule['format']; label: string }[] = [
  { value: 'json', label: 'JSON' },
  { value: 'slack', label: 'Slack' },
  { value: 'discord', label: 'Discord' },
  { value: 'teams', label: 'Microsoft Teams' },
]

/** "Success reaches 90 %". */
export function ruleInWords({ event, threshold }: Pick<AlertRule, 'event' | 'threshold'>): string {
  if (event === 'success') return `Success reaches ${Number(((threshold ?? 0) * 100).toFixed(1))} %`
  if (event === 'stuck') return `A run waits for ${threshold} minutes`
  if (event === 'disk') return `Less than ${threshold} GiB are left on the disk`
  return EVENTS.find(({ value }) => value === event)?.label ?? event
}

/** "Slack: hooks.example.org", "ada@example.org", "Browser": a webhook's whole URL is a secret of its own. */
export function targetInWords({ channel, target, format }: Pick<AlertRule, 'channel' | 'target' | 'format'>) {
  if (channel === 'browser') return 'Browser'
  if (channel === 'mail') return target ?? ''
  const form = FORMATS.find(({ value }) => value === format)?.label ?? format
  return `${form}: ${hostOf(target ?? '')}`
}

export function hostOf(url: string): string {
  try {
    return new URL(url).host
  } catch {
    return url
  }
}

/** What came of it, in a word. */
export const STATES: Record<Alert['state'], string> = {
  waiting: 'waits',
  sending: 'on its way',
  sent: 'sent',
  failed: 'not sent',
  unclear: 'unclear',
  withheld: 'withheld',
}
