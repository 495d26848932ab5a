/** The table of trainings with what finds, orders and groups them. */
import { Button, Select } from '@mantine/core'
import { type ReactNode, useCallback, useEffect, useState } from 'react'
import { $api } from '../api/client'
import { isRefusal } from '../api/errors'
import type { Group, ListedExperiment } from '../api/types'
import { Message, Panel, QueryError } from '../components/ui'
import { count, plural } from '../lib/format'
import { ColumnsButton } from './ColumnsButton'
import { QueryInput, useKeys } from './QueryInput'
import { TrainingsTable } from './TrainingsTable'
import { useRows, within } from './useRows'
import { chooseProject, chosenProject, DEFAULT_COLUMNS, type TableView } from './view'
import classes from './workbench.module.css'

const PLACES = [
  { value: 'live', label: 'Trainings' },
  { value: 'archived', label: 'Archive' },
  { value: 'trash', label: 'Trash' },
]
const EMPTY: Record<TableView['place'], string> = {
  live: 'No training here',
  archived: 'Nothing is archived',
  trash: 'The trash is empty',
}

interface TrainingsProps {
  view: TableView
  onView: (change: Partial<TableView>) => void
  ticked: readonly string[]
  onTick: (ids: readonly string[]) => void
  /** What stands in place of the list before the first training. */
  empty: ReactNode
  onStar?: (experiment: ListedExperiment) => void
  /** Between the search and the table. */
  above?: ReactNode
  /** Behind the search. */
  tools?: ReactNode
}

export function Trainings({ view, onView, ticked, onTick, empty, onStar, above, tools }: TrainingsProps) {
  const [open, setOpen] = useState<ReadonlySet<string>>(new Set())
  const data = useRows(view, open)
  const keys = useKeys(true)
  const search = useCallback((query: string) => onView({ query }), [onView])
  const { error, total, rows } = data
  const toggle = ({ query }: Group) =>
    setOpen((before) => {
      const after = new Set(before)
      if (!after.delete(query)) after.add(query)
      return after
    })
  if (error && !isRefusal(error) && rows.length === 0) {
    return (
      <Panel>
        <QueryError error={error} what="list of trainings" retry={data.refetch} />
      </Panel>
    )
  }
  if (total === 0 && view.query === '' && view.place === 'live' && !data.isPending && !error) {
    return (
      <>
        {onStar && (
          <div className={classes.bar}>
            <ProjectSelect view={view} onView={onView} />
            <PlaceSelect view={view} onView={onView} />
          </div>
        )}
        <Panel>
          {view.project ? (
            <Message
              title="No training in this project"
              actions={
                <Button variant="default" onClick={() => onView(lookAt(''))}>
                  Show all projects
                </Button>
              }
            />
          ) : (
            empty
          )}
        </Panel>
      </>
    )
  }
  return (
    <>
      <div className={classes.bar}>
        <QueryInput query={view.query} onQuery={search} error={error} />
        <Select
          aria-label="Group by"
          placeholder="Group by"
          searchable
          clearable
          data={keys.filter(({ kind, of }) => kind !== 'time' && of !== 'metric').map(({ key }) => key)}
          value={view.by || null}
          onChange={(by) => onView({ by: by ?? '' })}
          w={150}
          comboboxProps={{ width: 280, position: 'bottom-end' }}
        />
        <ProjectSelect view={view} onView={onView} />
        {onStar && <PlaceSelect view={view} onView={onView} />}
        <ColumnsButton view={view} onView={onView} keys={keys} />
        {tools}
      </div>
      {above}
      <Panel flush>
        <TrainingsTable
          data={data}
          view={view}
          onView={onView}
          ticked={ticked}
          onTick={onTick}
          open={open}
          onOpen={toggle}
          onWhole={(group) => onView({ by: '', query: within(view.query, group) })}
          {...(onStar ? { onStar } : {})}
        />
        {total === 0 && (
          <Message
            title={view.query ? 'No training matches' : EMPTY[view.place]}
            actions={
              view.query && (
                <Button variant="default" onClick={() => onView({ query: '' })}>
                  Show all
                </Button>
              )
            }
          />
        )}
        <div className={classes.foot} role="status">
          <span>{total === undefined ? ' ' : plural(total, 'training')}</span>
          {view.by !== '' && <span>{count(rows.filter(({ kind }) => kind === 'group').length)} groups</span>}
        </div>
      </Panel>
    </>
  )
}

/** Keeps the choice: the next list begins with it, too. */
function lookAt(project: string): Partial<TableView> {
  chooseProject(project)
  return { project }
}

/** Which project is looked at; nothing where there is but one. */
function ProjectSelect({ view, onView }: Pick<TrainingsProps, 'view' | 'onView'>) {
  const { data } = $api.useQuery('get', '/api/projects', { params: { query: { limit: 200 } } })
  const projects = data?.items ?? []
  // Deleted since, or no longer this person's: nobody finds an empty list for what was chosen some time.
  const isGone =
    data !== undefined && data.total <= projects.length && !projects.some(({ id }) => id === view.project)
  const forgets = isGone && view.project !== '' && view.project === chosenProject()
  useEffect(() => {
    if (forgets) onView(lookAt(''))
  }, [forgets, onView])
  if (projects.length < 2 && !view.project) return null
  return (
    <Select
      aria-label="Project"
      placeholder="All projects"
      searchable
      clearable
      data={projects.map(({ id, name }) => ({ value: id, label: name }))}
      value={view.project || null}
      onChange={(project) => onView(lookAt(project ?? ''))}
      w={150}
      comboboxProps={{ width: 280, position: 'bottom-end' }}
    />
  )
}

function PlaceSelect({ view, onView }: Pick<TrainingsProps, 'view' | 'onView'>) {
  return (
    <Select
      aria-label="Where to look"
      data={PLACES}
      value={view.place}
      allowDeselect={false}
      onChange={(place) => onView({ place: (place ?? 'live') as TableView['place'] })}
      w={120}
    />
  )
}

/** The view of a picker, which has no address. */
export function usePickerView(): [TableView, (change: Partial<TableView>) => void] {
  const [view, setView] = useState<TableView>({
    query: '',
    project: chosenProject(),
    sort: '-created',
    columns: DEFAULT_COLUMNS,
    pinned: 0,
    by: '',
    place: 'live',
  })
  const change = useCallback((part: Partial<TableView>) => setView((before) => ({ ...before, ...part })), [])
  return [view, change]
}
