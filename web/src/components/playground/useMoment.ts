/** What the picture says of the moment that it shows: the page's numbers go with it, and not by a clock of their own. */
import { type RefObject, useEffect, useState } from 'react'
import type { Playground } from '../../api/types'

export type Moment = Pick<
  Playground,
  | 'sim_time'
  | 'robot'
  | 'target'
  | 'movers'
  | 'reward'
  | 'arrivals'
  | 'collisions'
  | 'timeouts'
  | 'value'
  | 'outcome'
  | 'seconds'
  | 'outdated'
>

/** A picture that has said nothing for so long shows nothing new: then the page says what the service last said. */
const SILENT_MS = 2_000

/** The newest that the picture in a frame within `box` has said; null where it has not lately. */
export function useMoment(box: RefObject<HTMLElement | null>): Moment | null {
  const [moment, setMoment] = useState<Moment | null>(null)
  useEffect(() => {
    let silence: ReturnType<typeof setTimeout> | undefined
    const hear = ({ origin, source, data }: MessageEvent) => {
      if (origin !== location.origin) return
      if (source !== box.current?.querySelector('iframe')?.contentWindow) return
      const said = (data as { playgroundMoment?: Moment } | null)?.playgroundMoment
      if (!said) return
      setMoment(said)
      clearTimeout(silence)
      silence = setTimeout(() => setMoment(null), SILENT_MS)
    }
    window.addEventListener('message', hear)
    return () => {
      clearTimeout(silence)
      window.removeEventListener('message', hear)
    }
  }, [box])
  return moment
}
