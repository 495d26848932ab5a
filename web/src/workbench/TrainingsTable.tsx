/**
 * Trainings as rows of a grid, of which only those in sight are drawn; on a narrow page as cards. By keyboard: arrows, Home
 * and End go from row to row, space ticks, Enter opens.
 */
import { Anchor, Button, Checkbox, Skeleton, Text } from '@mantine/core'
import { useMediaQuery } from '@mantine/hooks'
import { useVirtualizer } from '@tanstack/react-virtual'
import { type CSSProperties, type KeyboardEvent, useEffect, useRef, useState } from 'react'
import { Link, useNavigate } from 'react-router'
import type { Group, ListedExperiment } from '../api/types'
import { ExperimentSwatch } from '../charts/Swatch'
import { ExperimentMenu } from '../components/ExperimentMenu'
import { IconChevronDown, IconChevronRight, IconStar, IconStarFilled } from '../components/icons'
import { summaryOf } from '../lib/experiments'
import { age, count, plural, words } from '../lib/format'
import { useNow } from '../lib/hooks'
import { Cell, isNumber, Mean, NAME_WIDTH, Tags, titleOf, widthOf } from './cells'
import type { Row, Rows } from './useRows'
import { nextSort, type TableView } from './view'
import classes from './workbench.module.css'

const ROW_PX = 46
const CARD_PX = 100
const TICK_PX = 40
const MENU_PX = 48
/** Rows before the end of what is there at which more is asked for. */
const AHEAD = 30

interface TrainingsTableProps {
  data: Rows
  view: TableView
  onView: (change: Partial<TableView>) => void
  ticked: readonly string[]
  onTick: (ids: readonly string[]) => void
  open: ReadonlySet<string>
  onOpen: (group: Group) => void
  /** Shows what a group holds beyond what is shown. */
  onWhole: (group: Group) => void
  /** Without menus and stars: a picker. */
  onStar?: (experiment: ListedExperiment) => void
}

export function TrainingsTable(props: TrainingsTableProps) {
  const { data, view, onView, ticked, onTick } = props
  const { rows } = data
  const now = useNow()
  const navigate = useNavigate()
  // Known at once: a phone draws cards, not rows and then cards.
  const narrow = useMediaQuery('(max-width: 620px)', undefined, { getInitialValueInEffect: false })
  const scroll = useRef<HTMLDivElement>(null)
  const [active, setActive] = useState(0)
  const wanted = useRef<number | null>(null)
  const virtual = useVirtualizer({
    count: rows.length,
    getScrollElement: () => scroll.current,
    estimateSize: (index) => (narrow && rows[index]?.kind === 'training' ? CARD_PX : ROW_PX),
    overscan: 8,
    // As high as it will be about: the rows of the first picture are drawn with the page, not once more after it.
    initialRect: { width: 0, height: window.innerHeight * 0.8 },
    useFlushSync: false,
    getItemKey: (index) => rows[index]?.key ?? index,
  })
  // Other rows have other heights.
  const heights = `${narrow} ${view.by}`
  const measured = useRef(heights)
  useEffect(() => {
    if (measured.current !== heights) virtual.measure()
    measured.current = heights
  }, [heights, virtual])
  const shown = virtual.getVirtualItems()
  const last = shown.at(-1)?.index ?? 0
  const { more } = data
  useEffect(() => {
    if (last >= rows.length - AHEAD) more()
  }, [last, rows.length, more])

  const loaded = rows.flatMap((row) => (row.kind === 'training' ? [row.experiment.id] : []))
  const here = new Set(ticked)
  const tickedHere = loaded.filter((id) => here.has(id))
  const tick = (id: string) => onTick(here.has(id) ? ticked.filter((one) => one !== id) : [...ticked, id])
  const go = (index: number) => {
    const next = Math.max(0, Math.min(rows.length - 1, index))
    wanted.current = next
    setActive(next)
    virtual.scrollToIndex(next)
  }
  // A row far away is drawn some pictures after it was scrolled to, and has the focus from then on.
  useEffect(() => {
    if (wanted.current === null) return
    const row = scroll.current?.querySelector<HTMLElement>(`[data-index="${wanted.current}"]`)
    if (!row) return
    wanted.current = null
    row.focus({ preventScroll: true })
  })
  // What comes is gone to as it comes, until somebody wants to be elsewhere.
  const toEnd = useRef(false)
  const stay = () => {
    toEnd.current = false
    wanted.current = null
  }
  // biome-ignore lint/correctness/useExhaustiveDependencies: once for all rows that have come.
  useEffect(() => {
    if (toEnd.current) go(rows.length - 1)
  }, [rows.length])
  const onKeyDown = (event: KeyboardEvent<HTMLElement>, index: number, row: Row) => {
    if (event.target !== event.currentTarget) return
    toEnd.current = event.key === 'End'
    const page = Math.floor((scroll.current?.clientHeight ?? 0) / ROW_PX) - 2
    const steps: Record<string, number> = {
      ArrowDown: index + 1,
      ArrowUp: index - 1,
      PageDown: index + page,
      PageUp: index - page,
      Home: 0,
      End: rows.length - 1,
    }
    const to = steps[event.key]
    if (to !== undefined) go(to)
    else if (event.key === ' ' && row.kind === 'training') tick(row.experiment.id)
    else if (event.key === 'Enter' && row.kind === 'training') void navigate(pageOf(row.experiment))
    else if ((event.key === 'Enter' || event.key === ' ') && row.kind === 'group') props.onOpen(row.group)
    else return
    event.preventDefault()
  }

  const left = (place: number): CSSProperties =>
    place < 0 || narrow
      ? {}
      : {
          left:
            TICK_PX + NAME_WIDTH + view.columns.slice(0, place).reduce((sum, key) => sum + widthOf(key), 0),
        }
  const width = TICK_PX + NAME_WIDTH + MENU_PX + view.columns.reduce((sum, key) => sum + widthOf(key), 0)
  const headed = !narrow
  return (
    // biome-ignore lint/a11y/useSemanticElements: of a thousand rows a table element draws all.
    <div
      ref={scroll}
      className={classes.scroll}
      role="grid"
      aria-label="Trainings"
      aria-rowcount={(data.total ?? 0) + 1}
      aria-multiselectable
      data-testid="experiments"
      tabIndex={-1}
      onWheel={stay}
      onPointerDown={stay}
    >
      {headed && (
        // biome-ignore lint/a11y/useFocusableInteractive: its buttons are.
        // biome-ignore lint/a11y/useSemanticElements: as above.
        <div className={classes.head} role="row" style={{ width, minWidth: '100%' }} aria-rowindex={1}>
          <HeadCell label="Tick" width={TICK_PX} style={{ left: 0 }} fixed>
            <Checkbox
              size="xs"
              aria-label="Tick all"
              disabled={loaded.length === 0}
              checked={loaded.length > 0 && tickedHere.length === loaded.length}
              indeterminate={tickedHere.length > 0 && tickedHere.length < loaded.length}
              onChange={(event) =>
                onTick(
                  event.currentTarget.checked
                    ? [...new Set([...ticked, ...loaded])]
                    : ticked.filter((id) => !loaded.includes(id)),
                )
              }
            />
          </HeadCell>
          <SortCell
            column="name"
            width={NAME_WIDTH}
            style={{ left: TICK_PX }}
            fixed
            edge={view.pinned === 0}
            view={view}
            onView={onView}
          />
          {view.columns.map((key, place) => (
            <SortCell
              key={key}
              column={key}
              width={widthOf(key)}
              style={left(place < view.pinned ? place : -1)}
              fixed={place < view.pinned}
              edge={place === view.pinned - 1}
              view={view}
              onView={onView}
            />
          ))}
        </div>
      )}
      {/* biome-ignore lint/a11y/useSemanticElements: as above. */}
      <div
        className={classes.grid}
        role="rowgroup"
        style={{ height: virtual.getTotalSize(), width: narrow ? '100%' : width }}
      >
        {data.isPending && <Skeletons />}
        {shown.map((item) => {
          const row = rows[item.index]
          if (!row) return null
          const isTicked = row.kind === 'training' && here.has(row.experiment.id)
          return (
            // biome-ignore lint/a11y/useSemanticElements: as above.
            <div
              key={item.key}
              className={classes.row}
              role="row"
              data-testid={row.kind === 'training' ? 'experiment' : 'group'}
              data-index={item.index}
              aria-rowindex={item.index + 2}
              aria-selected={isTicked}
              aria-expanded={row.kind === 'group' ? row.open : undefined}
              tabIndex={item.index === Math.min(active, rows.length - 1) ? 0 : -1}
              style={{ height: item.size, transform: `translateY(${item.start}px)`, width: '100%' }}
              onFocus={() => setActive(item.index)}
              onKeyDown={(event) => onKeyDown(event, item.index, row)}
            >
              {row.kind === 'training' ? (
                narrow ? (
                  <CardCells
                    {...props}
                    experiment={row.experiment}
                    now={now}
                    ticked={isTicked}
                    onTick={tick}
                  />
                ) : (
                  <TrainingCells
                    {...props}
                    row={row}
                    experiment={row.experiment}
                    now={now}
                    ticked={isTicked}
                    onTick={tick}
                    left={left}
                  />
                )
              ) : row.kind === 'group' ? (
                <GroupCells {...props} group={row.group} opened={row.open} narrow={narrow} />
              ) : (
                <GridCell width={NAME_WIDTH + TICK_PX} style={{ paddingLeft: 62 }}>
                  <Button variant="subtle" size="compact-xs" onClick={() => props.onWhole(row.group)}>
                    All {count(row.group.experiments)} of them
                  </Button>
                </GridCell>
              )}
            </div>
          )
        })}
      </div>
    </div>
  )
}

interface TrainingCellsProps extends Omit<TrainingsTableProps, 'ticked' | 'onTick'> {
  experiment: ListedExperiment
  now: number
  ticked: boolean
  onTick: (id: string) => void
}

function TrainingCells({
  row,
  experiment,
  view,
  now,
  ticked,
  onTick,
  onStar,
  left,
}: TrainingCellsProps & {
  row: Extract<Row, { kind: 'training' }>
  left: (place: number) => CSSProperties
}) {
  return (
    <>
      <GridCell width={TICK_PX} style={{ left: 0 }} fixed>
        <Tick experiment={experiment} ticked={ticked} onTick={onTick} />
      </GridCell>
      <GridCell
        width={NAME_WIDTH}
        style={{ left: TICK_PX, ...(row.nested ? { paddingLeft: 32 } : {}) }}
        fixed
        edge={view.pinned === 0}
        className={classes.name}
      >
        {onStar && <Star experiment={experiment} onStar={onStar} />}
        <ExperimentSwatch id={experiment.id} />
        <Anchor component={Link} to={pageOf(experiment)} inherit title={experiment.name}>
          {experiment.name}
        </Anchor>
      </GridCell>
      {view.columns.map((key, place) => (
        <GridCell
          key={key}
          width={widthOf(key)}
          number={isNumber(key)}
          fixed={place < view.pinned}
          edge={place === view.pinned - 1}
          style={left(place < view.pinned ? place : -1)}
        >
          <div>
            <Cell row={experiment} column={key} now={now} />
          </div>
        </GridCell>
      ))}
      <GridCell width={MENU_PX} last>
        {onStar && view.place !== 'trash' && <ExperimentMenu experiment={experiment} />}
      </GridCell>
    </>
  )
}

/** A training of one run is that run: a page with nothing but a way to it would be one too many. */
const pageOf = ({ id, run_id }: ListedExperiment): string =>
  run_id === null ? `/experiments/${id}` : `/runs/${run_id}`

function CardCells({ experiment, view, now, ticked, onTick, onStar }: TrainingCellsProps) {
  return (
    // biome-ignore lint/a11y/useSemanticElements: of a thousand rows a table element draws all.
    // biome-ignore lint/a11y/useFocusableInteractive: the row is.
    <div role="gridcell" style={{ display: 'flex', flex: 1, minWidth: 0, alignItems: 'center' }}>
      <div style={{ padding: '0 10px' }}>
        <Tick experiment={experiment} ticked={ticked} onTick={onTick} />
      </div>
      <div className={classes.card}>
        <div>
          <ExperimentSwatch id={experiment.id} />
          <Anchor component={Link} to={pageOf(experiment)} inherit>
            {experiment.name}
          </Anchor>
          <span>{age(experiment.created_at, now)}</span>
        </div>
        <div>
          <Text span inherit truncate>
            {summaryOf(experiment)}
          </Text>
          <Tags tags={experiment.tags.slice(0, 2)} />
        </div>
        <div>
          <Cell row={experiment} column="state" now={now} />
          {experiment.success && (
            <span>
              <Mean mean={{ ...experiment.success, runs: experiment.success.seeds }} rate /> N ={' '}
              {experiment.success.seeds}
            </span>
          )}
        </div>
      </div>
      {onStar && view.place !== 'trash' && <ExperimentMenu experiment={experiment} />}
    </div>
  )
}

function GroupCells({
  group,
  opened,
  narrow,
  view,
  onOpen,
}: TrainingsTableProps & { group: Group; opened: boolean; narrow: boolean }) {
  const name = group.value === null ? 'none' : String(group.value)
  return (
    <>
      <GridCell width={TICK_PX} style={{ left: 0 }} fixed>
        <button
          type="button"
          className={classes.expand}
          aria-label={`${opened ? 'Close' : 'Open'} ${titleOf(view.by)} ${name}`}
          onClick={() => onOpen(group)}
        >
          {opened ? <IconChevronDown size={16} /> : <IconChevronRight size={16} />}
        </button>
      </GridCell>
      <GridCell
        width={narrow ? 240 : NAME_WIDTH}
        style={{ left: TICK_PX }}
        fixed
        edge
        className={classes.group}
      >
        <span>
          {typeof group.value === 'string' ? words(name) : name}
          <Text span size="xs" c="dimmed" ml={8} fw={400}>
            {plural(group.experiments, 'training')}, {plural(group.runs, 'run')}
          </Text>
        </span>
      </GridCell>
      {!narrow &&
        view.columns.map((key) => (
          <GridCell key={key} width={widthOf(key)} number={isNumber(key)}>
            {key === 'success' ? (
              <Mean mean={group.success} rate />
            ) : key === 'seeds' ? (
              <span>{count(group.runs)}</span>
            ) : key === 'state' ? (
              <Text span size="xs" c="dimmed">
                {Object.entries(group.states)
                  .map(([state, number]) => `${count(number)} ${state}`)
                  .join(', ')}
              </Text>
            ) : key.includes('/') ? (
              <Mean mean={group.metrics[key]} rate={key.endsWith('_rate')} />
            ) : null}
          </GridCell>
        ))}
      <GridCell width={MENU_PX} last />
    </>
  )
}

interface GridCellProps {
  width: number
  style?: CSSProperties
  fixed?: boolean
  edge?: boolean
  number?: boolean
  last?: boolean
  className?: string | undefined
  children?: React.ReactNode
}

function classesOf({ fixed, edge, last, className }: Omit<GridCellProps, 'width'>): string {
  return [classes.cell, fixed && classes.fixed, edge && classes.edge, last && classes.last, className]
    .filter(Boolean)
    .join(' ')
}

function GridCell({ width, style, number, children, ...look }: GridCellProps) {
  return (
    // biome-ignore lint/a11y/useSemanticElements: of a thousand rows a table element draws all.
    // biome-ignore lint/a11y/useFocusableInteractive: the row is.
    <div
      role="gridcell"
      className={classesOf(look)}
      style={{ width, ...style }}
      data-number={number || undefined}
    >
      {children}
    </div>
  )
}

function HeadCell({ label, width, style, children, ...look }: GridCellProps & { label: string }) {
  return (
    // biome-ignore lint/a11y/useSemanticElements: as above.
    // biome-ignore lint/a11y/useFocusableInteractive: what is in it is.
    <div
      role="columnheader"
      aria-label={label}
      className={`${classesOf(look)} ${classes.headCell}`}
      style={{ width, ...style }}
    >
      {children}
    </div>
  )
}

function SortCell({
  column,
  width,
  style,
  view,
  onView,
  ...look
}: GridCellProps & Pick<TrainingsTableProps, 'view' | 'onView'> & { column: string }) {
  const sorted = view.sort === column ? 'ascending' : view.sort === `-${column}` ? 'descending' : 'none'
  return (
    // biome-ignore lint/a11y/useSemanticElements: as above.
    // biome-ignore lint/a11y/useFocusableInteractive: its button is.
    <div
      role="columnheader"
      aria-sort={sorted}
      className={`${classesOf(look)} ${classes.headCell}`}
      style={{ width, ...style }}
      data-number={isNumber(column) || undefined}
      title={column}
    >
      <button type="button" onClick={() => onView({ sort: nextSort(view.sort, column) })}>
        {titleOf(column)}
        {sorted === 'ascending' ? ' ↑' : sorted === 'descending' ? ' ↓' : ''}
      </button>
    </div>
  )
}

function Tick({
  experiment,
  ticked,
  onTick,
}: {
  experiment: ListedExperiment
  ticked: boolean
  onTick: (id: string) => void
}) {
  return (
    <Checkbox
      size="xs"
      aria-label={`Tick ${experiment.name}`}
      checked={ticked}
      onChange={() => onTick(experiment.id)}
    />
  )
}

function Star({
  experiment,
  onStar,
}: {
  experiment: ListedExperiment
  onStar: (experiment: ListedExperiment) => void
}) {
  return (
    <button
      type="button"
      className={classes.star}
      aria-label={`Star ${experiment.name}`}
      aria-pressed={experiment.starred}
      onClick={() => onStar(experiment)}
    >
      {experiment.starred ? <IconStarFilled size={15} /> : <IconStar size={15} stroke={1.6} />}
    </button>
  )
}

function Skeletons() {
  return (
    <div aria-hidden style={{ padding: 14 }}>
      {['78%', '64%', '71%', '69%', '75%', '60%'].map((width) => (
        <Skeleton key={width} height={12} width={width} mb={26} />
      ))}
    </div>
  )
}
