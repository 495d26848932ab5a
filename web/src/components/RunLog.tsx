/** What a run's trainer printed and what happened to it, in one stream, the newest first; searched, and taken home. */
import { Button, Group, Skeleton, Text, TextInput } from '@mantine/core'
import { useDebouncedValue } from '@mantine/hooks'
import { keepPreviousData } from '@tanstack/react-query'
import { useState } from 'react'
import { $api } from '../api/client'
import type { LogLine, RunState } from '../api/types'
import { at } from '../lib/base'
import { count, dateTime, plural } from '../lib/format'
import { IconDownload } from './icons'
import classes from './RunLog.module.css'
import { Message, Panel, QueryError } from './ui'

const FIRST = 200
const MOST = 5_000
/** Printed lines are no changes that are told; while they may come, they are asked for. */
const LIVE_MS = 2_000

export function RunLog({ runId, state }: { runId: string; state: RunState }) {
  const [typed, setTyped] = useState('')
  const [limit, setLimit] = useState(FIRST)
  const [search] = useDebouncedValue(typed.trim(), 250)
  const live = state === 'running' || state === 'stopping'
  const log = $api.useQuery(
    'get',
    '/api/runs/{run_id}/log',
    { params: { path: { run_id: runId }, query: { limit, ...(search ? { search } : {}) } } },
    { placeholderData: keepPreviousData, refetchInterval: live ? LIVE_MS : false },
  )
  return (
    <Panel
      title="Log"
      flush
      data-testid="log"
      actions={
        <Group gap="xs">
          <TextInput
            size="xs"
            placeholder="Search"
            aria-label="Search the log"
            value={typed}
            onChange={(event) => setTyped(event.currentTarget.value)}
          />
          <Button
            component="a"
            href={at(`/api/runs/${runId}/log/text`)}
            size="xs"
            variant="default"
            leftSection={<IconDownload size={14} />}
          >
            Download
          </Button>
        </Group>
      }
    >
      {log.data ? (
        <Lines lines={log.data.lines} searched={search !== ''} />
      ) : log.error ? (
        <QueryError error={log.error} what="log" retry={log.refetch} />
      ) : (
        <Skeleton height={80} m="md" w="auto" />
      )}
      {log.data && log.data.total > log.data.lines.length && (
        <Group gap="sm" p="sm">
          <Text size="xs" c="dimmed">
            The last {count(log.data.lines.length)} of {plural(log.data.total, 'line')}.
          </Text>
          {limit < MOST && (
            <Button size="compact-xs" variant="subtle" onClick={() => setLimit(MOST)}>
              Show more
            </Button>
          )}
        </Group>
      )}
    </Panel>
  )
}

function Lines({ lines, searched }: { lines: readonly LogLine[]; searched: boolean }) {
  if (lines.length === 0) {
    return <Message title={searched ? 'No line holds this' : 'Nothing has happened yet'} />
  }
  return (
    // biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls is reached by the keyboard.
    <ol className={classes.log} data-testid="events" tabIndex={0} aria-label="Log">
      {[...lines].reverse().map((line, index) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: counted from the oldest, lines only come behind.
        <li key={`${line.at}-${lines.length - index}`} data-level={line.level} data-kind={line.kind}>
          <time dateTime={new Date(line.at * 1000).toISOString()}>{dateTime(line.at)}</time>
          <span className={classes.step}>
            {line.step === null ? `attempt ${line.attempt}` : `step ${count(line.step)}`}
          </span>
          <span className={classes.message}>{line.text}</span>
        </li>
      ))}
    </ol>
  )
}
