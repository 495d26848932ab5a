/** What may be measured on what: choices as the form and the address have them, and as the server wants them. */
import type { ArenaConfig, EvaluationRequest } from '../../api/types'

export type PolicyChoice = EvaluationRequest['policies'][number]
export type SuiteChoice = EvaluationRequest['suites'][number]

/** The controllers that need no training, as tables name them. */
export const BASELINES = [
  'random',
  'go-to-goal',
  'dynamic window',
  'VFH+',
  'MPPI',
  'mapping, A* and dynamic window',
  'ORCA, told where people are',
] as const

/** What `policyOf` reads: "shipped:simple", "baseline:VFH+", "training:4f2…", "checkpoint:9a1…". */
export function policyKey(source: PolicyChoice['source'], name: string): string {
  return `${source}:${name}`
}

export function policyOf(key: string): PolicyChoice | null {
  const [source, ...rest] = key.split(':')
  const name = rest.join(':')
  if (name === '') return null
  switch (source) {
    case 'shipped':
      return { source, name }
    case 'baseline': {
      const known = BASELINES.find((each) => each === name)
      return known ? { source, name: known, task: null } : null
    }
    case 'training':
    case 'checkpoint':
      return { source, id: name }
    case 'uploaded':
      return { source, id: name, task: null }
    default:
      return null
  }
}

/** "own", "name:crowd-200", "arena:{…}", "scenarios:4f2…". */
export const OWN = 'own'
export const suiteByName = (name: string) => `name:${name}`
export const suiteInArena = (arena: ArenaConfig) => `arena:${JSON.stringify(arena)}`
export const suiteOfOnesOwn = (id: string) => `scenarios:${id}`

/**
 * The suite of a key.
 * @param difficulty of families, 0 to 1, whatever the key's arena says.
 */
export function suiteOf(key: string, difficulty: number): SuiteChoice | null {
  if (key === OWN) return { by: 'own' }
  if (key.startsWith('name:')) return { by: 'name', name: key.slice(5) }
  // What it has the server knows.
  if (key.startsWith('scenarios:'))
    return { by: 'scenarios', id: key.slice(10), name: '', arenas: [], documents: [] }
  if (!key.startsWith('arena:')) return null
  try {
    const arena = JSON.parse(key.slice(6)) as ArenaConfig
    return { by: 'arena', arena: isFamily(arena) ? { ...arena, difficulty } : arena }
  } catch {
    return null
  }
}

/** Whether an arena is one of a family's many maps. */
export function isFamily<Arena extends { name: string }>(
  arena: Arena,
): arena is Extract<Arena, { difficulty: number }> {
  return 'difficulty' in arena
}

/** What an evaluation was asked on, until its suite's name is known. */
export function suiteTitle(choice: SuiteChoice): string {
  switch (choice.by) {
    case 'own':
      return 'Its own suite'
    case 'name':
      return choice.name
    case 'scenarios':
      return choice.name || "A suite of one's own"
    case 'arena':
      return isFamily(choice.arena)
        ? `${choice.arena.name}, difficulty ${choice.arena.difficulty}`
        : `${choice.arena.name} arena`
  }
}

/** The address of the form with these choices. */
export function evaluate(policies: readonly string[], suites: readonly string[] = []): string {
  const query = new URLSearchParams()
  for (const each of policies) query.append('policy', each)
  for (const each of suites) query.append('suite', each)
  return `/evaluations?${query}`
}

/** The address of the form that opens a playground, with a policy chosen. */
export const play = (policy: string): string => `/playground?${new URLSearchParams({ policy })}`
