/** An id for what stands once on a page, by which a label or a description is tied to it. */
import { useId as useReactId } from 'react'

/**
 * The given one, or one that stays as long as the component does. Mantine's components take it instead of their own hook
 * (plugins/mantineIds), which draws a random id in a layout effect: every input would be drawn twice, the second time in one
 * go that holds up the browser.
 */
export function useId(given?: string): string {
  const own = useReactId()
  return given ?? `mantine-${own.replace(/\W/g, '')}`
}
