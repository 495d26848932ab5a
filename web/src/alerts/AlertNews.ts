/** Shows what rules for the browser have said: on the page, and by the system where that was granted. */
import { notifications } from '@mantine/notifications'
import { useEffect, useState } from 'react'
import { $api } from '../api/client'
import { at, BASE } from '../lib/base'

/** Asked for in a hidden tab too: that is when somebody wants to be told. */
const EVERY_MS = 10_000
const KEY = `mapless.alerts.shown${BASE}`

/** The newest alert that this browser has shown, in any of its tabs; undefined before the first. */
function shown(): number | undefined {
  const text = window.localStorage.getItem(KEY)
  return text === null ? undefined : Number(text)
}

/** Draws nothing of its own: a component, so that news draw no page anew. */
export function AlertNews() {
  const [after, setAfter] = useState(shown)
  const { data } = $api.useQuery(
    'get',
    '/api/alerts/news',
    { params: { query: after === undefined ? {} : { after } } },
    { refetchInterval: EVERY_MS, refetchIntervalInBackground: true, gcTime: 0, meta: { ownPace: true } },
  )
  useEffect(() => {
    if (!data) return
    const before = shown()
    if (before !== data.newest) window.localStorage.setItem(KEY, String(data.newest))
    setAfter(data.newest)
    for (const { id, title, text, run_id, experiment_id } of data.items) {
      if (before === undefined || id <= before) continue
      notifications.show({ id: `alert-${id}`, title, message: text, autoClose: false })
      if (!('Notification' in window) || Notification.permission !== 'granted') continue
      // Of the same tag there is one, whichever tab was first.
      const note = new Notification(title, { body: text, tag: `mapless-${id}` })
      note.onclick = () => {
        window.focus()
        const path = run_id ? `/runs/${run_id}` : experiment_id ? `/experiments/${experiment_id}` : '/alerts'
        window.location.assign(at(path))
      }
    }
  }, [data])
  return null
}
