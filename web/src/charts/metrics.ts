/** The metrics of a run: which belong in one chart, and how they are called. */
import { compact, percent, significant } from '../lib/format'
import { wordsOf } from './words'

export interface ChartSpec {
  title: string
  note?: string
  metrics: readonly { name: string; label: string }[]
  /** All series whose names begin so, besides. */
  prefix?: string
  format?: (value: number) => string
  yRange?: readonly [number, number]
  smoothable?: boolean
}

/** What a chart is called in an address: its one metric, or else its title. */
export function nameOf({ title, note, metrics, prefix }: ChartSpec): string {
  const [only, ...more] = metrics
  if (only && more.length === 0 && prefix === undefined) return only.name
  return note ? `${title}, ${note}` : title
}

/** What a chart's values are, with their unit: all its metrics are of one kind. */
export function axisOf({ metrics, prefix }: ChartSpec): string {
  return wordsOf(metrics[0]?.name ?? `${prefix}*`).axis
}

const rate = { format: percent, yRange: [0, 1.02] as const }

/** What is looked at first. */
export const MAIN_CHARTS: readonly ChartSpec[] = [
  {
    title: 'Success rate',
    metrics: [
      { name: 'train/success_rate', label: 'training' },
      { name: 'eval/success_rate', label: 'evaluation' },
    ],
    smoothable: true,
    ...rate,
  },
  {
    title: 'Return',
    note: 'per episode',
    metrics: [
      { name: 'train/return', label: 'training' },
      { name: 'eval/return', label: 'evaluation' },
    ],
    smoothable: true,
  },
]

/** The rest, by section. */
export const SECTIONS: readonly { title: string; charts: readonly ChartSpec[] }[] = [
  {
    title: 'Episodes',
    charts: [
      {
        title: 'Reward',
        note: 'per step',
        metrics: [{ name: 'train/reward', label: 'training' }],
        smoothable: true,
      },
      {
        title: 'Reward terms',
        note: 'per step, their sum is the reward',
        metrics: [],
        prefix: 'reward/',
        smoothable: true,
      },
      {
        title: 'Episode length',
        note: 'steps',
        metrics: [{ name: 'train/episode_length', label: 'training' }],
        smoothable: true,
      },
      {
        title: 'How episodes end',
        note: 'training',
        metrics: [
          { name: 'train/success_rate', label: 'arrival' },
          { name: 'train/collision_rate', label: 'collision' },
          { name: 'train/timeout_rate', label: 'time-out' },
        ],
        smoothable: true,
        ...rate,
      },
    ],
  },
  {
    title: 'Learning',
    charts: [
      {
        title: 'Policy loss',
        metrics: [{ name: 'loss/policy', label: 'loss' }],
        smoothable: true,
        format: significant,
      },
      {
        title: 'Value loss',
        metrics: [{ name: 'loss/value', label: 'loss' }],
        smoothable: true,
        format: significant,
      },
      {
        title: 'KL divergence',
        note: 'old to new policy',
        metrics: [{ name: 'policy/kl', label: 'KL' }],
        smoothable: true,
        format: significant,
      },
      { title: 'Entropy', metrics: [{ name: 'policy/entropy', label: 'entropy' }], format: significant },
      {
        title: 'Exploration',
        note: 'standard deviation',
        metrics: [
          { name: 'policy/std_linear', label: 'linear' },
          { name: 'policy/std_lateral', label: 'lateral' },
          { name: 'policy/std_angular', label: 'angular' },
          { name: 'policy/std_steering', label: 'steering' },
        ],
        format: significant,
      },
      {
        title: 'Clipped samples',
        metrics: [{ name: 'policy/clip_fraction', label: 'fraction' }],
        format: percent,
        smoothable: true,
      },
      {
        title: 'Explained variance',
        note: 'of the returns, by the critic',
        metrics: [{ name: 'value/explained_variance', label: 'fraction' }],
        format: significant,
      },
      {
        title: 'Learning rate',
        metrics: [{ name: 'optim/learning_rate', label: 'rate' }],
        format: significant,
      },
    ],
  },
  {
    title: 'Behaviour',
    charts: [
      {
        title: 'Commands',
        note: 'fractions of the limits',
        metrics: [
          { name: 'train/linear_speed', label: 'linear' },
          { name: 'train/lateral_speed', label: 'lateral' },
          { name: 'train/angular_speed', label: 'angular' },
          { name: 'train/steering', label: 'steering' },
          { name: 'train/spin', label: 'turning one way' },
        ],
        smoothable: true,
        ...rate,
      },
      {
        title: 'Turning at its limit',
        note: 'share of commands',
        metrics: [{ name: 'policy/saturation', label: 'commands' }],
        smoothable: true,
        ...rate,
      },
      {
        title: 'Constant observations',
        note: 'share of their numbers',
        metrics: [{ name: 'observation/constant', label: 'numbers' }],
        ...rate,
      },
    ],
  },
  {
    title: 'Evaluation',
    charts: [
      {
        title: 'How episodes end',
        note: 'on the suite',
        metrics: [
          { name: 'eval/success_rate', label: 'arrival' },
          { name: 'eval/collision_rate', label: 'collision' },
          { name: 'eval/timeout_rate', label: 'time-out' },
        ],
        ...rate,
      },
      { title: 'Steps to the target', metrics: [{ name: 'eval/steps', label: 'steps' }] },
      {
        title: 'Path efficiency',
        note: 'shortest path over path driven',
        metrics: [{ name: 'eval/path_efficiency', label: 'efficiency' }],
        format: percent,
      },
      { title: 'Reward', note: 'per step', metrics: [{ name: 'eval/reward', label: 'reward' }] },
    ],
  },
  {
    title: 'Speed',
    charts: [
      {
        title: 'Steps per second',
        metrics: [{ name: 'time/steps_per_second', label: 'all robots' }],
        format: compact,
        smoothable: true,
      },
      {
        title: 'Where the time goes',
        metrics: [
          { name: 'time/simulation', label: 'simulation' },
          { name: 'time/inference', label: 'inference' },
          { name: 'time/update', label: 'update' },
          { name: 'time/evaluation', label: 'evaluation' },
          { name: 'time/reporting', label: 'reporting' },
        ],
        format: percent,
        yRange: [0, 1.02],
      },
    ],
  },
]
