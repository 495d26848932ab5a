/** Small hooks that several pages share. */
import { useCallback, useEffect, useState } from 'react'
import { useLocation, useNavigate, useSearchParams } from 'react-router'

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
  return [wholeNumber(text), set]
}

/** In the address, the first episode is 1, as it is called on the pages. Links from before have another name, and count from 0. */
const REPLAY = 'replay'
const REPLAY_BEFORE = 'episode'
/** Who is shown beside, once for each. */
const TOGETHER = 'with'
/** What the history keeps beside the address of a replay that was opened on its page: to close it is to go back. */
const OPENED_HERE = 'replay opened here'

/**
 * The episode that is replayed, counted from 0, or null. Opening one is a step of its own, so that Back closes it, and closing
 * it goes back; going from one to the next is no step.
 */
export function useReplayInAddress(): [number | null, (episode: number | null) => void] {
  const [search, setSearch] = useSearchParams()
  const navigate = useNavigate()
  const openedHere = useLocation().state === OPENED_HERE
  const wanted = wholeNumber(search.get(REPLAY))
  const episode = wanted === null ? wholeNumber(search.get(REPLAY_BEFORE)) : wanted - 1
  const open = episode !== null && episode >= 0
  const set = useCallback(
    (next: number | null) => {
      if (next === null && openedHere) {
        void navigate(-1)
        return
      }
      setSearch(
        (before) => {
          const after = new URLSearchParams(before)
          after.delete(REPLAY_BEFORE)
          if (next === null) {
            after.delete(REPLAY)
            after.delete(TOGETHER)
          } else after.set(REPLAY, String(next + 1))
          return after
        },
        {
          replace: open || next === null,
          preventScrollReset: true,
          state: next !== null && (!open || openedHere) ? OPENED_HERE : null,
        },
      )
    },
    [open, openedHere, setSearch, navigate],
  )
  return [open ? episode : null, set]
}

/** The policies that a replay shows beside the one whose episode it is, as addresses of replays name them. */
export function useTogetherInAddress(): [string[], (others: readonly string[]) => void] {
  const [search, setSearch] = useSearchParams()
  const { state } = useLocation()
  const set = useCallback(
    (others: readonly string[]) =>
      setSearch(
        (before) => {
          const after = new URLSearchParams(before)
          after.delete(TOGETHER)
          for (const each of others) after.append(TOGETHER, each)
          return after
        },
        { replace: true, preventScrollReset: true, state },
      ),
    [setSearch, state],
  )
  return [[...new Set(search.getAll(TOGETHER))], set]
}

function wholeNumber(text: string | null): number | null {
  return text !== null && /^\d{1,9}$/.test(text) ? Number(text) : null
}
