/** What happened in a run, the newest first. */
import type { RunEvent } from '../api/types'
import { count, dateTime } from '../lib/format'
import classes from './EventLog.module.css'
import { Message } from './ui'

export function EventLog({ events }: { events: readonly RunEvent[] }) {
  if (events.length === 0) return <Message title="Nothing has happened yet" />
  return (
    <ol className={classes.log} data-testid="events">
      {[...events].reverse().map((event) => (
        <li key={event.id} data-level={event.level}>
          <time dateTime={new Date(event.at * 1000).toISOString()}>{dateTime(event.at)}</time>
          <span className={classes.step}>step {count(event.step)}</span>
          <span className={classes.message}>{event.message}</span>
        </li>
      ))}
    </ol>
  )
}
