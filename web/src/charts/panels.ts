/** Panels: any metric that was reported, as a chart of its own. */
import { percent, significant } from '../lib/format'
import { type ChartSpec, MAIN_CHARTS, SECTIONS } from './metrics'
import { wordsOf } from './words'

/** How a metric's panel looks: as a chart, less its metrics. */
export type PanelLook = Omit<ChartSpec, 'metrics' | 'prefix'> & { y: string }

/** What is looked at where nobody has chosen. */
export const USUAL_PANELS: readonly string[] = [
  'eval/success_rate',
  'train/success_rate',
  'train/return',
  'eval/steps',
]

/** So many are drawn on a page, and printed in a report. */
export const MOST_PANELS = 24
/** The others are drawn when one comes near. */
export const PANELS_AT_ONCE = 4
/** What the server takes for a metric's name. */
const LONGEST_NAME = 64

/** Names as they stand in an address, as far as they can be panels; null where there is none. */
export function panelsOf(names: readonly string[]): readonly string[] | null {
  const found = [...new Set(names)].filter((name) => name.length > 0 && name.length <= LONGEST_NAME)
  return found.length > 0 ? found.slice(0, MOST_PANELS) : null
}

const RATE = { format: percent, yRange: [0, 1.02] as const }
const EVALUATION = 'eval/'
/** Of metrics that no section knows. */
export const OTHERS = 'Others'

/** A metric's panel: its own words, and all else as its chart on a run's page has it, where there is one. */
export function lookOf(name: string): PanelLook {
  const { title, axis, note, share } = wordsOf(name)
  const spec = CHARTS.find((one) => shows(one, name))
  const { format, yRange } = spec ?? (share ? RATE : { format: significant })
  return {
    title,
    y: axis,
    ...(note ? { note } : {}),
    ...(format ? { format } : {}),
    ...(yRange ? { yRange } : {}),
    smoothable: !name.startsWith(EVALUATION) && (spec ? spec.smoothable === true : true),
  }
}

/** Metrics by the sections of a run's page, each in the order in which it came: first those that a section shows, then their kin. */
export function grouped(names: readonly string[]): { group: string; names: readonly string[] }[] {
  const groups = new Map<string, string[]>(
    [...SECTIONS.map(({ title }) => title), OTHERS].map((one) => [one, []]),
  )
  for (const name of names) groups.get(groupOf(name))?.push(name)
  return [...groups].flatMap(([group, some]) => (some.length > 0 ? [{ group, names: some }] : []))
}

function groupOf(name: string): string {
  const begins = name.slice(0, name.indexOf('/') + 1)
  const kin = ({ metrics }: ChartSpec) => begins !== '' && metrics.some((one) => one.name.startsWith(begins))
  const section =
    SECTIONS.find(({ charts }) => charts.some((one) => shows(one, name))) ??
    SECTIONS.find(({ charts }) => charts.some(kin))
  return section?.title ?? OTHERS
}

const CHARTS = [...MAIN_CHARTS, ...SECTIONS.flatMap(({ charts }) => charts)]

const shows = ({ metrics, prefix }: ChartSpec, name: string): boolean =>
  metrics.some((one) => one.name === name) || (prefix !== undefined && name.startsWith(prefix))
