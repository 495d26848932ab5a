/** Answers of the server as the tests use them, typed by its OpenAPI. */
import type { components } from '../api/schema'
import type {
  Checkpoint,
  CheckpointPage,
  Comparison,
  Curves,
  EpisodeReplay,
  EpisodeSeries,
  Episodes,
  Estimate,
  Experiment,
  FieldMatrix,
  ListedExperiment,
  LiveState,
  Profiles,
  Reproduction,
  Run,
  RunDetail,
  ShippedPolicy,
  Status,
} from '../api/types'

export const NOW = Date.UTC(2026, 10, 21, 12) / 1000

export const status: Status = {
  version: '0.1.0',
  commit: 'c0ffee1',
  workers: [
    { name: 'worker-1', last_seen: NOW, run_id: 'run1', draining: false, trouble: null, extensions: [] },
    { name: 'worker-2', last_seen: NOW, run_id: null, draining: false, trouble: null, extensions: [] },
  ],
  queued: 0,
  extensions: [],
  running: 1,
}

export const run: Run = {
  id: 'run1',
  experiment_id: 'exp1',
  seed: 0,
  state: 'running',
  attempt: 1,
  step: 120_000,
  total_steps: 300_000,
  steps_per_second: 14_000,
  seconds_left: 12.9,
  success_rate: 0.91,
  eval_success_rate: 0.885,
  worker: 'worker-1',
  error: null,
  created_at: NOW - 60,
  started_at: NOW - 50,
  finished_at: null,
  thins_at: null,
  thinned: null,
}

const network = { name: 'mlp' as const, hidden_sizes: [64, 64], activation: 'relu' as const }

/** A training as the form's schema below describes it, with enough of the rest for lists and headings. */
export const training = {
  task: {
    robot: { name: 'burger' },
    arena: { name: 'simple', movers: { count: 0, kind: 'pedestrian', speed: 1, radius: 0.25 } },
    observation: 'improved',
    reward: {
      terms: [
        { name: 'arrival', weight: 120 },
        { name: 'progress', weight: 500, exponential: false },
      ],
    },
  },
  algorithm: { name: 'ppo', network, learning_rate: 0.001, robots: 256 },
  steps: 300_000,
} as unknown as Experiment['training']

const noneFailed: NonNullable<Estimate['failed']> = {
  failed: 0,
  seeds: 2,
  at_most: 0.776,
  sentence: 'None of 2 seeds failed: up to 78 % may (one-sided 95 %).',
  told: true,
}

const twoSeeds: Estimate = {
  value: 0.984,
  low: 0.961,
  high: 0.993,
  unit: 'seeds',
  seeds: 2,
  episodes: 400,
  per_seed: [0.98, 0.988],
  failed: noneFailed,
}

const onePolicy = (value: number, low: number, high: number, episodes: number): Estimate => ({
  value,
  low,
  high,
  unit: 'episodes',
  seeds: 1,
  episodes,
  per_seed: [value],
  failed: null,
})

export const experiment: Experiment = {
  id: 'exp1',
  project_id: 'default',
  name: 'Corridor',
  created_at: NOW - 7200,
  training,
  unreadable: [],
  lacking: [],
  state: 'running',
  parallel_runs: null,
  campaign: null,
  study_id: null,
  runs: [
    run,
    {
      ...run,
      id: 'run2',
      seed: 1,
      state: 'completed',
      step: 300_000,
      seconds_left: null,
      steps_per_second: null,
    },
  ],
  success: twoSeeds,
}

/** The same in short. */
export const listed: ListedExperiment = {
  id: experiment.id,
  project_id: experiment.project_id,
  name: experiment.name,
  created_at: experiment.created_at,
  arena: 'simple',
  arena_title: 'Simple',
  run_id: null,
  movers: 0,
  robot: 'burger',
  algorithm: 'ppo',
  network: 'mlp',
  reward: 'basic',
  unreadable: [],
  state: 'running',
  states: ['completed', 'running'],
  runs: 2,
  progress: 0.7,
  seconds_left: 12.9,
  campaign: null,
  study_id: null,
  success: experiment.success,
  tags: [],
  starred: false,
  noted: false,
  archived: false,
  deleted_at: null,
  settings: {},
  metrics: {},
}

export const runDetail: RunDetail = {
  ...run,
  experiment_name: 'Corridor',
  training,
  unreadable: [],
  lacking: [],
  waits_for: [],
}

export const live: LiveState = {
  mode: 'policy',
  robots: 8,
  speed: 1,
  rays: true,
  ray_robots: 'followed',
  follow: null,
  status: { connected: true, receiving: true, watchers: 1 },
}

const best: Checkpoint = {
  id: 'cp2',
  step: 100_000,
  size: 436_112,
  sha256: 'cd'.repeat(32),
  created_at: NOW - 20,
  damaged: false,
  goes_at: null,
  best: true,
  evaluation: {
    suite: 'simple-200',
    suite_hash: 'c0ffee',
    episodes: 200,
    arrivals: 177,
    success: onePolicy(0.885, 0.833, 0.922, 200),
    steps_mean: 104.2,
    reward_mean: 1790,
  },
}

/** The newest first. */
export const checkpoints: CheckpointPage = {
  items: [
    best,
    {
      id: 'cp1',
      step: 50_000,
      size: 436_112,
      sha256: 'ab'.repeat(32),
      created_at: NOW - 40,
      damaged: false,
      goes_at: null,
      best: false,
      evaluation: null,
    },
  ],
  total: 2,
  best,
}

export const noCheckpoints: CheckpointPage = { items: [], total: 0, best: null }

export const episodes: Episodes = {
  checkpoint_id: 'cp2',
  suite: 'simple-200',
  suite_hash: 'c0ffee',
  episodes: [
    ['arrival', 90, 4.4, 4, 0.5],
    ['collision', 12, 0.6, 3, 0],
    ['timeout', 500, 20, 3, 0.2],
    ['arrival', 120, 5, 5, 0.1],
    ['collision', 30, 1.4, 3, 0.05],
  ].map(([outcome, steps, path_length, shortest_path, min_clearance]) => ({
    outcome,
    steps,
    reward: 1,
    path_length,
    shortest_path,
    min_clearance,
  })) as Episodes['episodes'],
}

export const replay: EpisodeReplay = {
  episode: 1,
  suite: 'simple-200',
  seconds: 2.4,
  page: '/replays/checkpoint:cp2/1/',
  policies: [
    {
      of: 'checkpoint:cp2',
      title: 'Corridor, seed 1, step 100 000',
      colour: '#339af0',
      outcome: 'collision',
      steps: 12,
      seconds: 2.4,
      faithful: true,
    },
  ],
}

export const episodeSeries: EpisodeSeries = {
  policies: [
    {
      of: 'checkpoint:cp2',
      times: [0, 1.2, 2.4],
      series: [
        { chart: 'ahead', name: 'range ahead', unit: 'm', values: [2, 1, 0.1] },
        { chart: 'linear', name: 'asked for', unit: 'm/s', values: [0, 0.2, 0.2] },
        { chart: 'linear', name: 'driven', unit: 'm/s', values: [0, 0.1, 0.2] },
        { chart: 'reward', name: 'all', unit: '', values: [0, 1, -100] },
        { chart: 'reward', name: 'collision', unit: '', values: [0, 0, -100] },
      ],
    },
  ],
}

const row = (name: string, value: number, episodes = 200) => ({
  name,
  success: onePolicy(value, value - 0.01, value, episodes),
  collision: 1 - value,
  timeout: 0,
  spl: 0.9 * value,
  steps: 92.4,
})

export const policy: ShippedPolicy = {
  name: 'crowd',
  title: 'Crowd',
  description: 'Drives between 17 obstacles.',
  command: 'python -m workers.shipped.build crowd',
  training,
  seed: 7,
  step: 250_000,
  size: 27_530,
  results: [
    {
      suite: 'simple-200',
      suite_hash: 'c0ffee',
      policy: row('Crowd', 0.99),
      baselines: [row('go-to-goal', 0.5), row('dynamic window', 0.98)],
    },
    {
      suite: 'clutter-500',
      suite_hash: 'beef',
      policy: row('Crowd', 0.95, 500),
      baselines: [row('go-to-goal', 0.25, 500), row('dynamic window', 0.998, 500)],
    },
  ],
}

const family = (value: number, evaluation: string | null = null) => ({
  success: onePolicy(value, value - 0.1, value, 100),
  collision: 0.05,
  worst_tenth_spl: value > 0.9 ? 0.62 : 0,
  evaluation,
  suite_hash: evaluation && 'abc',
})

export const field: FieldMatrix = {
  families: ['maze', 'clutter'],
  sights: [
    {
      rays: 60,
      field_of_view: 360,
      drivers: [
        { title: 'Crowd', policy: 'crowd', trained: true, cells: [family(0.19), family(0.99)] },
        { title: 'dynamic window', policy: null, trained: false, cells: [family(0.18), null] },
      ],
    },
  ],
  asked: [{ title: 'Mine, step 200', policy: null, trained: true, cells: [null, family(0.93, 'ev1')] }],
  command: 'python -m benchmarks.field',
  date: '2026-11-22',
}

export const curves: Curves = {
  since: null,
  follow: null,
  name: 'eval/success_rate',
  across: 'steps',
  spacing: 'points',
  steps: [0, 100, 200],
  x: null,
  experiments: [
    {
      id: 'exp1',
      name: 'Corridor',
      seeds: [
        { seed: 0, thinned: false, values: [0.1, 0.5, 0.9] },
        { seed: 1, thinned: false, values: [0.3, 0.7, null] },
      ],
      mean: [0.2, 0.6, 0.9],
      low: [0.1, 0.5, null],
      high: [0.3, 0.7, null],
      count: [2, 2, 1],
      unplaced: 0,
    },
    {
      id: 'exp2',
      name: 'Alone',
      seeds: [{ seed: 0, thinned: false, values: [0.4, 0.5, 0.6] }],
      mean: [0.4, 0.5, 0.6],
      low: [null, null, null],
      high: [null, null, null],
      count: [1, 1, 1],
      unplaced: 0,
    },
  ],
}

export const comparison: Comparison = {
  experiments: [
    {
      id: 'exp1',
      name: 'Corridor',
      seeds: 2,
      episodes: 400,
      suite: 'simple-200',
      suite_hash: 'c0ffee',
      success: twoSeeds,
      steps_per_target: {
        ...twoSeeds,
        value: 104.2,
        low: 101.9,
        high: 106.7,
        per_seed: [104, 104.4],
        failed: null,
      },
      reward: { ...twoSeeds, value: 1790, low: 1772, high: 1804, per_seed: [1785, 1795], failed: null },
    },
    {
      id: 'exp2',
      name: 'Alone',
      seeds: 0,
      episodes: 0,
      suite: null,
      suite_hash: null,
      success: null,
      steps_per_target: null,
      reward: null,
    },
  ],
  differences: [
    { path: 'algorithm.learning_rate', values: [0.001, 0.0003], left_out: [false, false] },
    { path: 'algorithm.network.hidden_sizes', values: [[64, 64], null], left_out: [false, false] },
    { path: 'task.reward.terms.progress.weight', values: [500, null], left_out: [false, true] },
  ],
  base: 'exp1',
  verdicts: [
    {
      measure: 'success',
      base: 'exp1',
      other: 'exp2',
      word: 'refused',
      difference: null,
      low: null,
      high: null,
      margin: 0.02,
      p: null,
      p_holm: null,
      paired: null,
      reason: 'No verdict below 5 seeds: Corridor has 2 to show.',
    },
    {
      measure: 'steps_per_target',
      base: 'exp1',
      other: 'exp2',
      word: 'better',
      difference: -8.1,
      low: -12.3,
      high: -3.9,
      margin: 5.2,
      p: 0.0004,
      p_holm: 0.0004,
      paired: { test: 'signed rank', scenarios: 180, better: 120, worse: 41, p: 0.012, p_holm: 0.012 },
      reason: '8.1 steps to the target fewer, 95 % interval [-12.3, -3.9].',
    },
  ],
  comparisons: 1,
  improvements: [{ base: 'exp1', other: 'exp2', value: 0.62, low: 0.55, high: 0.69 }],
  warnings: ['Alone has not been evaluated yet.'],
} as Comparison

export const profiles: Profiles = {
  thresholds: [0, 0.5, 1],
  experiments: [
    { id: 'exp1', name: 'Corridor', seeds: 2, mean: [0.9, 0.8, 0], low: [0.8, 0.6, 0], high: [1, 0.9, 0.1] },
    { id: 'exp2', name: 'Alone', seeds: 0, mean: [], low: [], high: [] },
  ],
}

const ADVANCED = { 'x-advanced': true }

/** A launch form with one of everything that pydantic writes: unions in unions, ranges, lists, factories' defaults. */
export const form = {
  schema: {
    title: 'ExperimentCreate',
    type: 'object',
    properties: {
      name: { type: 'string', title: 'Name', default: 'My first policy', maxLength: 120 },
      seeds: {
        type: 'array',
        items: { type: 'integer' },
        title: 'Seeds',
        default: [0],
        minItems: 1,
        maxItems: 50,
      },
      training: { $ref: '#/$defs/Training', title: 'Training', default: training },
    },
    $defs: {
      Training: {
        title: 'TrainingConfig',
        type: 'object',
        properties: {
          task: { $ref: '#/$defs/Task', title: 'Task' },
          algorithm: {
            title: 'Algorithm',
            oneOf: [{ $ref: '#/$defs/Ppo' }, { $ref: '#/$defs/Ddpg' }],
            discriminator: { propertyName: 'name', mapping: { ddpg: '#/$defs/Ddpg', ppo: '#/$defs/Ppo' } },
          },
          steps: { type: 'integer', title: 'Steps', default: 300_000, minimum: 1000, maximum: 1_000_000_000 },
        },
      },
      Task: {
        title: 'TaskConfig',
        type: 'object',
        properties: {
          arena: { $ref: '#/$defs/Arena', title: 'Arena' },
          observation: {
            type: 'string',
            enum: ['paper', 'improved'],
            title: 'Observation',
            default: 'improved',
          },
          reward: { $ref: '#/$defs/Reward', title: 'Reward' },
        },
      },
      Arena: {
        type: 'object',
        title: 'ArenaConfig',
        properties: {
          name: { type: 'string', enum: ['simple', 'complex'], title: 'Arena', default: 'simple' },
        },
      },
      Reward: {
        type: 'object',
        title: 'RewardConfig',
        properties: {
          terms: {
            type: 'array',
            title: 'Terms',
            minItems: 1,
            items: {
              oneOf: [{ $ref: '#/$defs/Arrival' }, { $ref: '#/$defs/Progress' }],
              discriminator: {
                propertyName: 'name',
                mapping: { arrival: '#/$defs/Arrival', progress: '#/$defs/Progress' },
              },
            },
            default: [
              { name: 'arrival', weight: 120 },
              { name: 'progress', weight: 500, exponential: false },
            ],
            'x-presets': {
              Basic: [
                { name: 'arrival', weight: 120 },
                { name: 'progress', weight: 500, exponential: false },
              ],
              Sparse: [{ name: 'arrival', weight: 1 }],
            },
          },
        },
      },
      Arrival: {
        type: 'object',
        description: 'The target is reached.',
        properties: {
          name: { type: 'string', const: 'arrival', title: 'Arrival', default: 'arrival' },
          weight: { type: 'number', title: 'Weight', default: 120, ...ADVANCED },
        },
      },
      Progress: {
        type: 'object',
        description: 'Metres by which the target came nearer.',
        properties: {
          name: { type: 'string', const: 'progress', title: 'Progress', default: 'progress' },
          weight: { type: 'number', title: 'Weight', default: 500, ...ADVANCED },
          exponential: { type: 'boolean', title: 'Exponential', default: false, ...ADVANCED },
        },
      },
      Network: {
        title: 'Network',
        oneOf: [{ $ref: '#/$defs/ResBlock' }, { $ref: '#/$defs/Mlp' }],
        discriminator: {
          propertyName: 'name',
          mapping: { mlp: '#/$defs/Mlp', resblock: '#/$defs/ResBlock' },
        },
      },
      ResBlock: {
        type: 'object',
        properties: { name: { type: 'string', const: 'resblock', title: 'ResBlock', default: 'resblock' } },
      },
      Mlp: {
        type: 'object',
        properties: {
          name: { type: 'string', const: 'mlp', title: 'MLP', default: 'mlp' },
          hidden_sizes: {
            type: 'array',
            items: { type: 'integer', minimum: 4, maximum: 1024 },
            minItems: 1,
            title: 'Hidden layers',
            default: [64, 64],
            ...ADVANCED,
          },
          activation: {
            type: 'string',
            enum: ['relu', 'tanh'],
            title: 'Activation',
            default: 'relu',
            ...ADVANCED,
          },
        },
      },
      Ppo: {
        type: 'object',
        properties: {
          name: { type: 'string', const: 'ppo', title: 'PPO', default: 'ppo' },
          network: { $ref: '#/$defs/Network', title: 'Network', default: network },
          learning_rate: {
            type: 'number',
            title: 'Learning rate',
            default: 0.001,
            exclusiveMinimum: 0,
            maximum: 0.1,
            ...ADVANCED,
          },
          robots: { type: 'integer', title: 'Robots', default: 256, minimum: 1, maximum: 4096, ...ADVANCED },
        },
      },
      Ddpg: {
        type: 'object',
        properties: {
          name: { type: 'string', const: 'ddpg', title: 'DDPG', default: 'ddpg' },
          network: {
            $ref: '#/$defs/Network',
            title: 'Network',
            default: { ...network, hidden_sizes: [128, 128] },
          },
          tau: { type: 'number', title: 'Target rate', default: 0.01, ...ADVANCED },
        },
      },
    },
  },
  defaults: { name: 'My first policy', seeds: [0], training },
  presets: [
    { id: 'default', title: 'Default', description: 'Small and quick.', training },
    {
      id: 'paper',
      title: 'Paper settings',
      description: 'As published.',
      training: {
        ...training,
        task: { ...training.task, observation: 'paper' },
        algorithm: { ...training.algorithm, network: { name: 'resblock' } },
      },
    },
  ],
} as unknown as components['schemas']['TrainingForm']

const paperRow = { collisions: null, reward: 9.07, episodes: 87, success: 0.678, steps: 114.9 }
const spread = (mean: number) => ({ mean, low: mean - 0.01, high: mean + 0.01 })
const campaignRun = {
  id: 'run1',
  seed: 0,
  state: 'completed' as const,
  progress: 1,
  error: null,
  measured: { reward: 14.2, episodes: 91, success: 0.83, collisions: 0.13, steps: 109.5 },
}

/** A campaign of one table with two rows: one seed done, one running; one failed, one queued. */
export const reproduction: Reproduction = {
  campaign: {
    id: 'camp1',
    created_at: NOW - 600,
    state: 'running',
    seeds: 2,
    effort: 1,
    progress: 0.43,
    seconds_left: 400,
  },
  campaigns: [{ id: 'camp1', created_at: NOW - 600 }],
  workers: 2,
  seconds: 930,
  curve: 'train/return',
  tables: [
    {
      id: 'complex-basic',
      title: 'Complex arena, basic reward',
      rows: ['complex-ddpg', 'complex-resblock'],
      labels: ['DDPG', 'ResBlock PPO'],
    },
  ],
  figures: [
    { id: 'complex-basic', title: 'Complex arena, basic reward', rows: ['complex-ddpg', 'complex-resblock'] },
  ],
  rows: [
    {
      id: 'complex-ddpg',
      method: 'DDPG',
      instead_of: null,
      paper: { ...paperRow, reward: 11.23, success: 0.937 },
      ours: null,
      experiment_id: 'exp2',
      runs: [
        { ...campaignRun, id: 'run3', state: 'failed', measured: null, error: 'out of memory' },
        { ...campaignRun, id: 'run4', seed: 1, state: 'queued', progress: 0, measured: null },
      ],
    },
    {
      id: 'complex-resblock',
      method: 'ResBlock PPO',
      instead_of: null,
      paper: paperRow,
      ours: {
        reward: spread(14.2),
        episodes: spread(91),
        success: spread(0.83),
        collisions: spread(0.13),
        steps: spread(109.5),
        failed: noneFailed,
      },
      experiment_id: 'exp1',
      runs: [
        campaignRun,
        { ...campaignRun, id: 'run2', seed: 1, state: 'running', progress: 0.55, measured: null },
      ],
    },
    {
      id: 'complex-ddpg-penalised',
      method: 'DDPG, logit penalty',
      instead_of: 'complex-ddpg',
      paper: { ...paperRow, reward: 11.23, success: 0.937 },
      ours: null,
      experiment_id: null,
      runs: [],
    },
  ],
  claims: [
    {
      id: 'complex-success',
      statement: 'In the complex arena DDPG arrives more often.',
      source: 'Results, table 2',
      word: 'holds',
      reason: '9.6 points more, 95 % interval [+6.6, +12.6], all of it in favour of the claim.',
      compatibility: {
        word: 'compatible',
        sentence: 'The paper’s effect, +25.8 points, lies inside our interval: compatible.',
      },
      evidence: 'The paper: 59 of 63 against 59 of 87.',
      reading: null,
      rows: ['complex-ddpg', 'complex-resblock'],
      other_way: {
        word: "can't be told",
        reason: '2.1 points more, 95 % interval [-1.0, +5.2]: 5 seeds show neither.',
        compatibility: null,
        rows: ['complex-ddpg-penalised', 'complex-resblock'],
      },
    },
    {
      id: 'adapts',
      statement: 'It adapts swiftly.',
      source: 'Results',
      word: "can't be told",
      reason: 'Nothing changes in either arena.',
      compatibility: null,
      evidence: null,
      reading: null,
      rows: [],
      other_way: null,
    },
  ],
  wanted: {},
}
