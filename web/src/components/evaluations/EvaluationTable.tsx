/** Evaluations that were asked for: how far they are, and what came of them. */
import { ActionIcon, Anchor, Group, Table, Text, Tooltip, VisuallyHidden } from '@mantine/core'
import { Link } from 'react-router'
import { $api } from '../../api/client'
import type { AskedEvaluation } from '../../api/types'
import { duration, percent, significant, words } from '../../lib/format'
import table from '../ExperimentTable.module.css'
import { IconTrash, IconX } from '../icons'
import { SuccessEstimate } from '../MeasuredEstimate'
import { useChange } from '../people/useChange'
import { ProgressBar } from '../ui'
import ui from '../ui.module.css'
import { suiteTitle } from './choices'

export const isOpen = ({ state }: AskedEvaluation) => state === 'queued' || state === 'running'

export const titleOf = ({ title, policy }: AskedEvaluation) =>
  policy.source === 'baseline' ? words(title) : title

export function EvaluationTable({ evaluations }: { evaluations: readonly AskedEvaluation[] }) {
  const settle = useChange()
  const cancel = $api.useMutation(
    'post',
    '/api/evaluations/{evaluation_id}/cancel',
    settle('call the evaluation off'),
  )
  const remove = $api.useMutation(
    'delete',
    '/api/evaluations/{evaluation_id}',
    settle('delete the evaluation'),
  )
  return (
    <Table.ScrollContainer type="native" minWidth={340}>
      <Table className={table.table} highlightOnHover aria-label="Evaluations">
        <Table.Thead>
          <Table.Tr>
            <Table.Th>Policy</Table.Th>
            <Table.Th>Suite</Table.Th>
            <Table.Th>Success, 95 % interval</Table.Th>
            <Table.Th ta="right" visibleFrom="sm">
              Collision
            </Table.Th>
            <Table.Th ta="right" visibleFrom="sm" title="Success weighted by path length">
              SPL
            </Table.Th>
            <Table.Th ta="right" visibleFrom="md">
              Time to target
            </Table.Th>
            <Table.Th ta="right" visibleFrom="md" title="Mean of the episodes' smallest distance to anything">
              Clearance
            </Table.Th>
            <Table.Th w={44}>
              <VisuallyHidden>Actions</VisuallyHidden>
            </Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {evaluations.map((each) => (
            <Table.Tr key={each.id} data-testid="evaluation" data-state={each.state}>
              <Table.Td>
                <Anchor component={Link} to={`/evaluations/${each.id}`} size="sm" fw={550}>
                  {titleOf(each)}
                </Anchor>
              </Table.Td>
              <Table.Td>{each.suite ?? suiteTitle(each.choice)}</Table.Td>
              <Outcome evaluation={each} />
              <Table.Td ta="right">
                <Action
                  evaluation={each}
                  onCancel={() => cancel.mutate({ params: { path: { evaluation_id: each.id } } })}
                  onDelete={() => remove.mutate({ params: { path: { evaluation_id: each.id } } })}
                />
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  )
}

function Outcome({ evaluation }: { evaluation: AskedEvaluation }) {
  const { figures, state, error } = evaluation
  if (figures === null) {
    return (
      <Table.Td colSpan={5}>
        {isOpen(evaluation) ? (
          <Progress evaluation={evaluation} />
        ) : (
          <Text size="sm" c={state === 'failed' ? 'red' : 'dimmed'}>
            {state === 'cancelled' ? 'Called off' : (error ?? 'It failed.')}
          </Text>
        )}
      </Table.Td>
    )
  }
  return (
    <>
      <Table.Td>
        <SuccessEstimate estimate={figures.success} />
      </Table.Td>
      <Table.Td ta="right" className={ui.number} visibleFrom="sm">
        {percent(figures.collision)}
      </Table.Td>
      <Table.Td ta="right" className={ui.number} visibleFrom="sm">
        {figures.spl.toFixed(2)}
      </Table.Td>
      <Table.Td ta="right" className={ui.number} visibleFrom="md">
        {figures.seconds === null ? '–' : `${significant(figures.seconds, 3)} s`}
      </Table.Td>
      <Table.Td ta="right" className={ui.number} visibleFrom="md">
        {figures.min_clearance.toFixed(2)} m
      </Table.Td>
    </>
  )
}

/** A bar with the time that is left. */
export function Progress({ evaluation }: { evaluation: AskedEvaluation }) {
  const { state, progress, seconds_left: left, waits_for: lacking } = evaluation
  if (state === 'queued') {
    const having = lacking.map(({ name, version }) => `${name} ${version}`).join(', ')
    return (
      <Text size="sm" c="dimmed">
        {lacking.length > 0 ? `Waits for a worker that has ${having}` : 'Waits for a worker'}
      </Text>
    )
  }
  return (
    <Group gap="sm" wrap="nowrap">
      <div style={{ flex: 1, minWidth: 80 }}>
        <ProgressBar value={progress} state="running" label="Evaluated" />
      </div>
      <Text size="xs" c="dimmed" className={ui.number}>
        {left === null ? 'Running' : `${duration(left)} left`}
      </Text>
    </Group>
  )
}

interface ActionProps {
  evaluation: AskedEvaluation
  onCancel: () => void
  onDelete: () => void
}

function Action({ evaluation, onCancel, onDelete }: ActionProps) {
  const label = isOpen(evaluation) ? 'Call it off' : 'Delete'
  return (
    <Tooltip label={label}>
      <ActionIcon
        variant="subtle"
        color="gray"
        aria-label={`${label}: ${titleOf(evaluation)}`}
        onClick={isOpen(evaluation) ? onCancel : onDelete}
      >
        {isOpen(evaluation) ? <IconX size={16} /> : <IconTrash size={16} stroke={1.6} />}
      </ActionIcon>
    </Tooltip>
  )
}
