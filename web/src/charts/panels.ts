/** Panels: any metric that was reported, as a chart of its own. */
import { percent, significant, words } from '../lib/format'
import { type ChartSpec, MAIN_CHARTS, SECTIONS } from './metrics'

/** How a metric's panel looks; as a chart's, less its metrics. */
export type PanelLook = Omit<ChartSpec, 'metrics' | 'prefix'>

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
const REWARD = 'reward/'

/** Those that are looked at usually have titles as short as they can be. */
const SHORT: Record<string, PanelLook> = {
  'eval/success_rate': { title: 'Success rate', note: 'evaluation', ...RATE },
  'train/success_rate': { title: 'Success rate', note: 'training', smoothable: true, ...RATE },
  'train/return': { title: 'Return', note: 'per episode, training', smoothable: true },
  'eval/steps': { title: 'Steps to the target', note: 'evaluation' },
}

/** A metric's panel: as its chart on a run's page where there is one, else as its name says. */
export function lookOf(name: string): PanelLook {
  return SHORT[name] ?? inCharts(name) ?? byName(name)
}

function inCharts(name: string): PanelLook | undefined {
  for (const spec of [...MAIN_CHARTS, ...SECTIONS.flatMap(({ charts }) => charts)]) {
    const metric = spec.metrics.find((one) => one.name === name)
    if (!metric) continue
    const { metrics, prefix: _, note: __, title, ...look } = spec
    return { ...look, title: metrics.length > 1 ? `${title}: ${metric.label}` : title, note: name }
  }
  return undefined
}

function byName(name: string): PanelLook {
  const smoothable = !name.startsWith(EVALUATION)
  if (name.startsWith(REWARD))
    return { title: `Reward: ${words(name.slice(REWARD.length)).toLowerCase()}`, note: name, smoothable }
  const isRate = name.endsWith('_rate') && !name.endsWith('learning_rate')
  return { title: name, smoothable, ...(isRate ? RATE : { format: significant }) }
}
