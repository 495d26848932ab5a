/** Rules for checkpoints in words. */
import type { KeepRule } from '../../api/types'
import { plural } from '../../lib/format'

export function ruleInWords({ last, every, best }: KeepRule): string {
  if (last == null) return 'All stay'
  const parts = [
    last === 1 ? 'the newest' : `the newest ${last}`,
    ...(every == null ? [] : [`one in ${every}`]),
    ...(best ? ['the best'] : []),
  ]
  return `Of each run ${parts.join(', ')}`
}

export function goingInWords(going: number, size: string): string {
  return going === 0
    ? 'Nothing goes by this rule.'
    : `${plural(going, 'checkpoint')} of ${size} go by this rule.`
}
