/**
 * What stands at the head of the pages that are called the same for everybody: the build writes it into their HTML
 * (plugins/pages), where it is read before any script has come, and the application draws the same (components/ui).
 */
import type { ROUTES } from './routes'

type PageName = (typeof ROUTES)[keyof typeof ROUTES]

export interface Head {
  title: string
  /** What the page is for. In it `code`, and [links](/to) within the pages and without. */
  about?: string
  /** What the page is one of, and where that is. */
  within?: readonly [title: string, to: string]
}

export const HEADS = {
  TrainingsPage: {
    title: 'Trainings',
    about:
      'What robots learn now and have learned: how far each training is, and how well its robots arrive.',
  },
  NewTrainingPage: {
    title: 'New training',
    about:
      'What is to be learned, where, and for how long. Every setting has a value that works: only what matters to you needs a change.',
  },
  ComparePage: {
    title: 'Compare',
    about:
      'Trainings side by side: how well they arrive, which is better and by how much, and their curves. Every figure has its interval.',
  },
  PoliciesPage: {
    title: 'Policies',
    about:
      'Trained policies that come with Mapless: watch them drive, measure them where you want to know it, take them to a robot, ' +
      'or train them further.',
  },
  ArenasPage: {
    title: 'Arenas',
    about:
      'Imported are arenas in our own YAML or JSON, Gazebo worlds (.world, .sdf) with cylinders and boxes, and ROS maps (the YAML ' +
      'file and its image, chosen together). What moves in a world comes with it: actors by their trajectories, models that a ' +
      'plugin moves by its keyframes or its source (.cc), chosen together with the world.',
  },
  ArenaEditorPage: {
    title: 'Draw an arena',
    about:
      'Walls, boxes, people and where robots start: draw them, see at once whether every target can be reached, and train in it.',
  },
  QueuePage: {
    title: 'Queue and workers',
    about:
      'What waits, what for and in which order, and who works. What is launched begins by itself; drag it, or give it a priority, to ' +
      'have it begin before others.',
  },
  EvaluationsPage: {
    title: 'Evaluations',
    about:
      'How well policies do where you want to know it: some seconds each, beside trainings. What is measured already is not measured again.',
  },
  LeaderboardPage: {
    title: 'Leaderboards',
    about:
      'All that was evaluated on the same scenarios, the best first, with intervals, and who is tied with the best.',
    within: ['Evaluations', '/evaluations'],
  },
  RecordingsPage: {
    title: 'From a robot',
    about:
      'What a robot did, beside what a policy would have done in its place, and where the two part. Noise, dropout, rate, delay and ' +
      'limits of acceleration are fitted, to train with. A few seconds in which the robot stands tell the noise of its LiDAR.',
  },
  StudiesPage: {
    title: 'Studies',
    about:
      'A study looks for good settings: in the form of a new training, give a number a range, or a choice several values.',
  },
  PlayPage: {
    title: 'Playground',
    about:
      'A policy drives while you move its target, obstacles, people and the robot itself, push it, and dim what it sees.',
  },
  ReproductionPage: {
    title: 'Reproduce the paper',
    about:
      'The experiments of Taheri, Hosseini, Nekoui: “Deep Reinforcement Learning with Enhanced PPO for Safe Mobile Robot Navigation”, ' +
      'trained and measured here.',
  },
  ProjectsPage: { title: 'Projects' },
  AlertsPage: {
    title: 'Alerts',
    about:
      'Be told when a training ends, fails or stands still: on these pages, and by the channels of the server.',
  },
  ProjectPage: {
    title: 'Project',
    about:
      'Who is in it, and as what: viewers look and take home, editors also launch and change, admins also invite.',
    within: ['Projects', '/projects'],
  },
  NotFoundPage: {
    title: 'There is no page here',
    about: 'The address may be mistyped, or what it led to has been deleted.',
  },
  PeoplePage: { title: 'People and workers' },
  StoragePage: {
    title: 'Storage',
    about:
      'Of each run the newest checkpoint always stays, and so does what a training began with, what somebody had evaluated, and ' +
      'what a run stands by on leaderboards.',
  },
  AuditPage: { title: 'What was done' },
  ApiPage: {
    title: 'API',
    about:
      'Everything on these pages goes over HTTP, and so it does from a program. Send a token as `Authorization: Bearer …`; ' +
      '[your account](/account) makes one. The Python client and the commands do that for you. Programs read the same from ' +
      '[openapi.json](/api/openapi.json).',
  },
} as const satisfies Partial<Record<PageName, Head>>

/** Of the page of this name; none where each has a title of its own. */
export const headOf = (page: string): Head | undefined => (HEADS as Partial<Record<string, Head>>)[page]

export interface Part {
  text: string
  to?: string | undefined
  code?: boolean
}

const MARKED = /`([^`]+)`|\[([^\]]+)\]\(([^)]+)\)/

export interface Name {
  /** Of the answer to what the page asks first (`FIRST_QUESTIONS`): "{experiment_name}, seed {seed}". */
  title: string
  /** Likewise: what it is. */
  about?: string
  within: readonly [title: string, to: string]
}

/** Pages that are called what the API says: public/frame.js asks, and writes it into their HTML. */
export const NAMES: { readonly [page in PageName]?: Name } = {
  ExperimentPage: { title: '{name}', within: ['Trainings', '/'] },
  RunPage: { title: '{experiment_name}, seed {seed}', within: ['Trainings', '/'] },
  PolicyPage: { title: '{title}', about: '{description}', within: ['Policies', '/policies'] },
}

export const nameOf = (page: string): Name | undefined => NAMES[page as PageName]

/** What a page is one of, and where that is. */
export const withinOf = (page: string) => (headOf(page) ?? nameOf(page))?.within

/** An introduction as it is drawn: text, code and links. */
export function partsOf(about: string): Part[] {
  const marked = MARKED.exec(about)
  if (!marked) return about ? [{ text: about }] : []
  const [all, code, text, to] = marked
  const before = about.slice(0, marked.index)
  return [
    ...(before ? [{ text: before }] : []),
    code ? { text: code, code: true } : { text: text ?? '', to },
    ...partsOf(about.slice(marked.index + all.length)),
  ]
}
