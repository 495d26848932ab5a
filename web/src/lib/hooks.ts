/** Small hooks that several pages share. */
import { useCallback, useEffect, useState } from 'react'
import { useSearchParams } from 'react-router'

/** Names the tab: "Runs – Mapless". */
export function useTitle(title: string): void {
  useEffect(() => {
    document.title = `${title} – Mapless`
  }, [title])
}

/** The time in epoch seconds, renewed every `everySeconds`: what ages are seen from. */
export function useNow(everySeconds = 15): number {
  const [now, setNow] = useState(() => Date.now() / 1000)
  useEffect(() => {
    const timer = setInterval(() => setNow(Date.now() / 1000), everySeconds * 1000)
    return () => clearInterval(timer)
  }, [everySeconds])
  return now
}

/** A whole number of the address's query, or null; setting it leaves the rest of the query as it is. */
export function useNumberInAddress(name: string): [number | null, (value: number | null) => void] {
  const [search, setSearch] = useSearchParams()
  const text = search.get(name)
  const set = useCallback(
    (value: number | null) =>
      setSearch(
        (before) => {
          const after = new URLSearchParams(before)
          if (value === null) after.delete(name)
          else after.set(name, String(value))
          return after
        },
        { replace: true, preventScrollReset: true },
      ),
    [name, setSearch],
  )
  return [text !== null && /^\d{1,9}$/.test(text) ? Number(text) : null, set]
}
