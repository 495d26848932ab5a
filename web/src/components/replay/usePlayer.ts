/** The player inside its frame: what time it shows, and how to bring it to another. */
import { type RefObject, useCallback, useEffect, useState } from 'react'

interface Player {
  /** Seconds since the episode's start that the picture shows; null before it has begun. */
  time: number | null
  /** Shows that moment; the player pauses there. */
  seek: (seconds: number) => void
}

/** Talks to the page in `frame`, `page` being its address: with another one, its time begins anew. */
export function usePlayer(frame: RefObject<HTMLIFrameElement | null>, page: string | undefined): Player {
  const [shown, setShown] = useState<{ page: string | undefined; time: number } | null>(null)
  useEffect(() => {
    const hear = (event: MessageEvent) => {
      if (event.origin !== location.origin || event.source !== frame.current?.contentWindow) return
      const seconds = (event.data as { replaySeconds?: unknown } | null)?.replaySeconds
      if (typeof seconds === 'number') setShown({ page, time: seconds })
    }
    window.addEventListener('message', hear)
    return () => window.removeEventListener('message', hear)
  }, [frame, page])
  const seek = useCallback(
    (seconds: number) => frame.current?.contentWindow?.postMessage({ replaySeek: seconds }, location.origin),
    [frame],
  )
  return { time: shown?.page === page ? (shown?.time ?? null) : null, seek }
}
