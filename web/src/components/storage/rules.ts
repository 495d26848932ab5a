/** Rules for checkpoints and for curves in words. */
import type { CurveRule, CurveThinning, KeepRule, Run } from '../../api/types'
import { count, dateTime, fileSize, plural } from '../../lib/format'

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

/** Null where curves stay as they are. */
export function curveRuleInWords({ points, after_days }: CurveRule): string | null {
  return points == null
    ? null
    : `Curves: ${count(points)} points a metric ${plural(after_days, 'day')} after a run's end`
}

export function thinningInWords({ runs, points, kept, frees, spared }: CurveThinning): string {
  if (spared !== null) return `No curve is thinned: ${spared}.`
  return runs === 0
    ? 'No curve is thinned by this rule now.'
    : `${count(points)} points of ${plural(runs, 'run')} become ${count(kept)}, which frees about ${fileSize(frees)}.`
}

/** What became of a run's curves, or will; null where they stay. */
export function thinnedInWords({ thinned, thins_at }: Run): string | null {
  if (thinned !== null)
    return (
      `Curves were thinned on ${dateTime(thinned.since)}: of ${count(thinned.points)} points ${count(thinned.kept)} ` +
      'means of neighbours are left, with their bands. Evaluations are whole.'
    )
  return thins_at === null ? null : `A rule thins these curves on ${dateTime(thins_at)}; see Storage.`
}
