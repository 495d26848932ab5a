/** From the server's validation errors to the fields that they are about. */
import type { Json } from './schema'
import { pathKey, valueAt } from './values'

/** One entry of a 422's `detail`, as pydantic and FastAPI write it. */
export interface ValidationProblem {
  loc: (string | number)[]
  msg: string
  type: string
  /** Of a query: where its fault is, in characters. */
  ctx?: { position?: number }
}

/** Messages by path; '' holds those about the form as a whole. */
export type Problems = Readonly<Record<string, string>>

/**
 * The path of a field from pydantic's `loc`. It starts with "body" and names the tag of each union on the way
 * (["body", "training", "algorithm", "ppo", "network"]); a tag is no key of the values, but the value of one.
 */
function locToPath(loc: readonly (string | number)[], values: Json): (string | number)[] {
  const path: (string | number)[] = []
  for (const part of loc[0] === 'body' ? loc.slice(1) : loc) {
    const here = valueAt(values, path)
    const isTag =
      here !== null &&
      typeof here === 'object' &&
      !Array.isArray(here) &&
      !(part in here) &&
      Object.values(here).includes(part)
    if (!isTag) path.push(part)
  }
  return path
}

/** All problems of a response, by path. Two about one field are joined. */
export function problemsByPath(details: readonly ValidationProblem[], values: Json): Problems {
  const problems: Record<string, string> = {}
  for (const { loc, msg } of details) {
    const key = pathKey(locToPath(loc, values))
    const message = msg.replace(/^Value error, /, '')
    const text = message.charAt(0).toUpperCase() + message.slice(1)
    problems[key] = problems[key] ? `${problems[key]}; ${text}` : text
  }
  return problems
}

/** The problem of a field: its own, or one of an item in it (a list is one field). */
export function problemOf(problems: Problems, key: string): string | undefined {
  const own = problems[key]
  const inside = Object.entries(problems)
    .filter(([path]) => path.startsWith(`${key}.`))
    .map(([, message]) => message)
  return [own, ...inside].filter(Boolean).join('; ') || undefined
}
