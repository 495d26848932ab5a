/** Small hooks that several pages share. */
import { useEffect, useState } from 'react'

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
