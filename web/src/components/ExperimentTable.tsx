/** Experiments as rows; ticking some chooses them for comparison. */
import { Anchor, Checkbox, Table, Text } from '@mantine/core'
import { Link } from 'react-router'
import type { ListedExperiment } from '../api/types'
import { algorithmOf, summaryOf } from '../lib/experiments'
import { age, dateTime, duration, percent, words } from '../lib/format'
import { useNow } from '../lib/hooks'
import { ExperimentMenu } from './ExperimentMenu'
import classes from './ExperimentTable.module.css'
import { SuccessEstimate } from './MeasuredEstimate'
import { isActive } from './states'
import { LoadingRows, ProgressBar, StateLabel } from './ui'
import ui from './ui.module.css'

interface ExperimentTableProps {
  /** Undefined while they are being loaded. */
  experiments: readonly ListedExperiment[] | undefined
  ticked: readonly string[]
  onTick: (ids: readonly string[]) => void
  /** Without the menu: a picker. */
  menu?: boolean
}

export function ExperimentTable({ experiments, ticked, onTick, menu = true }: ExperimentTableProps) {
  const now = useNow()
  const ids = experiments?.map((experiment) => experiment.id) ?? []
  const tickedHere = ids.filter((id) => ticked.includes(id))
  return (
    <Table.ScrollContainer type="native" minWidth={330}>
      <Table highlightOnHover className={classes.table} data-testid="experiments">
        <Table.Thead>
          <Table.Tr>
            <Table.Th w={36}>
              <Checkbox
                size="xs"
                aria-label="Tick all"
                disabled={ids.length === 0}
                checked={ids.length > 0 && tickedHere.length === ids.length}
                indeterminate={tickedHere.length > 0 && tickedHere.length < ids.length}
                onChange={(event) =>
                  onTick(
                    event.currentTarget.checked
                      ? [...new Set([...ticked, ...ids])]
                      : ticked.filter((id) => !ids.includes(id)),
                  )
                }
              />
            </Table.Th>
            <Table.Th>Name</Table.Th>
            <Table.Th className={classes.state}>State</Table.Th>
            <Table.Th visibleFrom="md" w={60} ta="right">
              Seeds
            </Table.Th>
            <Table.Th visibleFrom="md" w={90}>
              Arena
            </Table.Th>
            <Table.Th visibleFrom="md" w={130}>
              Algorithm
            </Table.Th>
            <Table.Th visibleFrom="md" w={80}>
              Reward
            </Table.Th>
            <Table.Th visibleFrom="md" w={260}>
              Success, 95 % interval
            </Table.Th>
            <Table.Th visibleFrom="md" w={100} ta="right">
              Launched
            </Table.Th>
            {menu && <Table.Th w={44} aria-label="Actions" />}
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {experiments === undefined && <LoadingRows rows={6} columns={menu ? 10 : 9} />}
          {experiments?.map((experiment) => (
            <Table.Tr
              key={experiment.id}
              data-testid="experiment"
              data-ticked={ticked.includes(experiment.id) || undefined}
            >
              <Table.Td>
                <Checkbox
                  size="xs"
                  aria-label={`Tick ${experiment.name}`}
                  checked={ticked.includes(experiment.id)}
                  onChange={(event) =>
                    onTick(
                      event.currentTarget.checked
                        ? [...ticked, experiment.id]
                        : ticked.filter((id) => id !== experiment.id),
                    )
                  }
                />
              </Table.Td>
              <Table.Td className={classes.name}>
                <Anchor component={Link} to={`/experiments/${experiment.id}`} inherit>
                  {experiment.name}
                </Anchor>
                <Text hiddenFrom="md" size="xs" component="div" c="dimmed" fw={400} mt={2}>
                  {summaryOf(experiment)}
                  {experiment.success && (
                    <div>
                      <SuccessEstimate estimate={experiment.success} />
                    </div>
                  )}
                </Text>
              </Table.Td>
              <Table.Td>
                <Progress experiment={experiment} />
              </Table.Td>
              <Table.Td visibleFrom="md" ta="right" className={ui.number}>
                {experiment.runs}
              </Table.Td>
              <Table.Td visibleFrom="md">{words(experiment.arena)}</Table.Td>
              <Table.Td visibleFrom="md">{algorithmOf(experiment)}</Table.Td>
              <Table.Td visibleFrom="md">{words(experiment.reward)}</Table.Td>
              <Table.Td visibleFrom="md">
                <SuccessEstimate estimate={experiment.success} />
              </Table.Td>
              <Table.Td
                visibleFrom="md"
                ta="right"
                className={ui.number}
                title={dateTime(experiment.created_at)}
              >
                {age(experiment.created_at, now)}
              </Table.Td>
              {menu && (
                <Table.Td p={4}>
                  <ExperimentMenu
                    experiment={experiment}
                    onDeleted={() => onTick(ticked.filter((id) => id !== experiment.id))}
                  />
                </Table.Td>
              )}
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  )
}

function Progress({ experiment }: { experiment: ListedExperiment }) {
  const { state, progress, seconds_left: left } = experiment
  return (
    <div className={classes.progress}>
      <div>
        <StateLabel state={state} />
        {isActive(state) && (
          <span className={`${ui.number} ${ui.quiet} ${classes.left}`}>
            {left === null ? percent(progress) : `${duration(left)} left`}
          </span>
        )}
      </div>
      {isActive(state) && (
        <ProgressBar value={progress} state={state} label={`Progress of ${experiment.name}`} />
      )}
    </div>
  )
}
