/** What a training's row has under a key. */
import { Badge } from '@mantine/core'
import type { ListedExperiment, SeedMean } from '../api/types'
import { SuccessEstimate } from '../components/MeasuredEstimate'
import { isActive } from '../components/states'
import { ProgressBar, StateLabel } from '../components/ui'
import ui from '../components/ui.module.css'
import { algorithmOf } from '../lib/experiments'
import { age, count, dateTime, duration, percent, percentRange, significant, words } from '../lib/format'
import classes from './workbench.module.css'

/** Settings that every row has, by their short names. */
const SHORT = new Set(['arena', 'movers', 'robot', 'algorithm', 'network', 'reward'])
/** What rows have without being asked: everything else is a column to ask for. */
const ALWAYS = new Set([
  'name',
  'state',
  'success',
  'seeds',
  'tag',
  'created',
  'starred',
  'campaign',
  'study',
  'id',
  ...SHORT,
])

/** The columns whose values the server is to be asked for. */
export const askedFor = (columns: readonly string[]): string[] => columns.filter((key) => !ALWAYS.has(key))

const WIDTHS: Record<string, number> = {
  state: 196,
  success: 296,
  seeds: 64,
  arena: 110,
  algorithm: 130,
  reward: 100,
  tag: 150,
  created: 104,
  starred: 70,
}
export const NAME_WIDTH = 280

/** Pixels that a column is wide. */
export const widthOf = (key: string): number =>
  WIDTHS[key] ?? (key.includes('/') ? 190 : Math.min(200, Math.max(90, titleOf(key).length * 7 + 40)))

/** A key as a column's head: the last part of a setting's dotted name. */
export function titleOf(key: string): string {
  if (key === 'tag') return 'Tags'
  if (key === 'created') return 'Launched'
  if (key === 'success') return 'Success, 95 % interval'
  if (key.includes('/')) return key
  return words(key.split('.').at(-1) ?? key)
}

export const isNumber = (key: string): boolean => key === 'seeds' || key === 'created'

export function Cell({ row, column, now }: { row: ListedExperiment; column: string; now: number }) {
  switch (column) {
    case 'state':
      return <Progress row={row} />
    case 'success':
      return <SuccessEstimate estimate={row.success} />
    case 'seeds':
      return count(row.runs)
    case 'arena':
      return row.arena_title
    case 'algorithm':
      return algorithmOf(row)
    case 'tag':
      return <Tags tags={row.tags} />
    case 'created':
      return <time title={dateTime(row.created_at)}>{age(row.created_at, now)}</time>
    case 'starred':
      return row.starred ? 'Yes' : ''
    case 'id':
      return row.id
    case 'campaign':
      return row.campaign ?? ''
    case 'study':
      return row.study_id ?? ''
  }
  if (SHORT.has(column)) return words(String(row[column as 'robot']))
  if (column.includes('/')) return <Mean mean={row.metrics[column]} rate={isRate(column)} />
  return <Setting value={settingOf(row, column)} />
}

/** A setting by its whole name, or by the end of it. */
function settingOf(row: ListedExperiment, key: string): number | string | undefined {
  if (key in row.settings) return row.settings[key]
  const whole = Object.keys(row.settings).find((name) => name.endsWith(`.${key}`))
  return whole === undefined ? undefined : row.settings[whole]
}

const isRate = (name: string) => name.endsWith('_rate') && !name.endsWith('learning_rate')

function Setting({ value }: { value: number | string | undefined }) {
  if (value === undefined) return <span className={ui.quiet}>–</span>
  if (typeof value === 'number') return <span className={ui.number}>{significant(value, 6)}</span>
  return <span title={value}>{value}</span>
}

/** "12.4  11.8–13.0": the mean over the runs, and its interval. */
export function Mean({ mean, rate = false }: { mean: SeedMean | null | undefined; rate?: boolean }) {
  if (!mean) return <span className={ui.quiet}>–</span>
  const { value, low, high, runs } = mean
  const shown = (number: number) => (rate ? percent(number) : significant(number, 3))
  return (
    <span
      className={ui.number}
      title={`Mean of ${runs} ${runs === 1 ? 'run' : 'runs'}, 95 % interval over seeds`}
    >
      <strong>{shown(value)}</strong>
      {low !== null && high !== null && (
        <span className={ui.quiet}>
          {'  '}
          {rate ? percentRange(low, high) : `${shown(low)}–${shown(high)}`}
        </span>
      )}
    </span>
  )
}

export function Tags({ tags }: { tags: readonly string[] }) {
  return (
    <span className={classes.tags}>
      {tags.map((tag) => (
        <Badge key={tag} size="sm" variant="light" color="gray" tt="none" fw={500}>
          {tag}
        </Badge>
      ))}
    </span>
  )
}

function Progress({ row }: { row: ListedExperiment }) {
  const { state, progress, seconds_left: left } = row
  return (
    <div className={classes.progress}>
      <div>
        <StateLabel state={state} states={row.states} />
        {isActive(state) && (
          <span className={`${ui.number} ${ui.quiet}`}>
            {left === null ? percent(progress) : `${duration(left)} left`}
          </span>
        )}
      </div>
      {isActive(state) && <ProgressBar value={progress} state={state} label={`Progress of ${row.name}`} />}
    </div>
  )
}
