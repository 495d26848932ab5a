/** Components whose code comes when they are first drawn. */
import { type ComponentType, type ReactNode, startTransition, useEffect, useState } from 'react'

/** With what stands in its place until its code has come. */
type Lazily<Props> = ComponentType<Props & { meanwhile?: ReactNode }>

/**
 * A component that is there once its code is. Not by `Suspense`: what that has once waited for, React keeps back for a third of
 * a second, so that nothing flickers.
 */
export function lazily<Props extends object>(load: () => Promise<ComponentType<Props>>): Lazily<Props> {
  let come: ComponentType<Props> | undefined
  return function Lazily({ meanwhile = null, ...props }) {
    const [Known, setKnown] = useState(() => come)
    const [problem, setProblem] = useState<{ error: unknown }>()
    useEffect(() => {
      if (Known) return
      load().then(
        (code) => {
          come = code
          startTransition(() => setKnown(() => code))
        },
        (error: unknown) => setProblem({ error }),
      )
    }, [Known])
    // For whatever boundary is around it, as everything that a component throws.
    if (problem) throw problem.error
    return Known ? <Known {...(props as unknown as Props)} /> : meanwhile
  }
}
