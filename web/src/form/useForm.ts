/** The state of a form: values, the server's problems with them, and what each union branch held before it was left. */
import { useCallback, useRef, useState } from 'react'
import { type Problems, problemsByPath, type ValidationProblem } from './problems'
import { branches, defaults, type Json, type Schema } from './schema'
import { type Path, pathKey, valueAt, withValue } from './values'

export interface Form {
  values: Json
  problems: Problems
  set: (path: Path, value: Json) => void
  /** Swaps the object of a union for another branch: the one it held before, or that branch's defaults. */
  choose: (path: Path, union: Schema, root: Schema, tag: string) => void
  replace: (values: Json) => void
  refuse: (details: readonly ValidationProblem[]) => void
}

/** Whether `path` is `outer`, or lies in it; everything lies in the form itself, ''. */
const isWithin = (path: string, outer: string): boolean =>
  outer === '' || path === outer || path.startsWith(`${outer}.`)

/** A form that starts with `initial`. Changing a field takes its problems away, and those of what it lies in. */
export function useForm(initial: Json): Form {
  const [values, setValues] = useState(initial)
  const [problems, setProblems] = useState<Problems>({})
  const left = useRef(new Map<string, Json>())

  const set = useCallback((path: Path, value: Json) => {
    const key = pathKey(path)
    setValues((before) => withValue(before, path, value))
    setProblems((before) =>
      Object.fromEntries(Object.entries(before).filter(([at]) => !isWithin(at, key) && !isWithin(key, at))),
    )
  }, [])

  const choose = useCallback(
    (path: Path, union: Schema, root: Schema, tag: string) => {
      const { propertyName } = union.discriminator ?? { propertyName: 'name' }
      const current = valueAt(values, path)
      const currentTag = valueAt(values, [...path, propertyName])
      if (current !== undefined) left.current.set(`${pathKey(path)}:${currentTag}`, current)
      const branch = branches(union, root).find((one) => one.tag === tag)
      if (branch) set(path, left.current.get(`${pathKey(path)}:${tag}`) ?? defaults(branch.schema, root))
    },
    [values, set],
  )

  const replace = useCallback((next: Json) => {
    setValues(next)
    setProblems({})
  }, [])

  const refuse = useCallback(
    (details: readonly ValidationProblem[]) => setProblems(problemsByPath(details, values)),
    [values],
  )

  return { values, problems, set, choose, replace, refuse }
}
