/** Evaluations that were asked for: how far they are, and what came of them. */
import { ActionIcon, Anchor, Group, Table, Text, VisuallyHidden } from '@mantine/core'
import { useState } from 'react'
import { Link } from 'react-router'
import { $api } from '../../api/client'
import type { AskedEvaluation } from '../../api/types'
import { duration, percent, significant, words } from '../../lib/format'
import { endedSo } from '../../lib/useArrangement'
import { DeleteDialog } from '../DeleteDialog'
import table from '../ExperimentTable.module.css'
import { Hint } from '../Hint'
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
  const [deleted, setDeleted] = useState<AskedEvaluation>()
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
            <Table.Th w="24%">Policy</Table.Th>
            <Table.Th w="14%">Suite</Table.Th>
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
                  onDelete={() => setDeleted(each)}
                />
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
      {deleted && (
        <DeleteDialog
          opened
          what={`“${titleOf(deleted)}” on ${deleted.suite ?? suiteTitle(deleted.choice)}`}
          busy={remove.isPending}
          onClose={() => setDeleted(undefined)}
          onDelete={() =>
            remove.mutate(
              { params: { path: { evaluation_id: deleted.id } } },
              { onSettled: () => setDeleted(undefined) },
            )
          }
        >
          Its figures, its episodes and where its robots drove go for good, from leaderboards too. The policy
          stays, and can be measured again.
        </DeleteDialog>
      )}
    </Table.ScrollContainer>
  )
}

function Outcome({ evaluation }: { evaluation: AskedEvaluation }) {
  const { id, figures, state, error } = evaluation
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
        <Anchor component={Link} to={`/evaluations/${id}${endedSo('arrival')}`} c="inherit" size="sm">
          <SuccessEstimate estimate={figures.success} />
        </Anchor>
      </Table.Td>
      <Table.Td ta="right" className={ui.number} visibleFrom="sm">
        <Anchor component={Link} to={`/evaluations/${id}${endedSo('collision')}`} c="inherit" size="sm">
          {percent(figures.collision)}
        </Anchor>
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
  const { state, progress, seconds_left: left, waits_for: lacking, behind = [], starts_in } = evaluation
  if (state === 'queued') {
    const having = lacking.map(({ name, version }) => `${name} ${version}`).join(', ')
    return (
      <Text size="sm" c="dimmed">
        {lacking.length > 0
          ? `Waits for a worker that has ${having}`
          : behind[0] === undefined
            ? 'Waits for a worker'
            : `Waits behind ${words(behind[0])}${behind.length > 1 ? ` and ${behind.length - 1} more` : ''}`}
        {starts_in != null && `, about ${duration(starts_in)}`}
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
    <Hint label={label}>
      <ActionIcon
        variant="subtle"
        color="gray"
        aria-label={`${label}: ${titleOf(evaluation)}`}
        onClick={isOpen(evaluation) ? onCancel : onDelete}
      >
        {isOpen(evaluation) ? <IconX size={16} /> : <IconTrash size={16} stroke={1.6} />}
      </ActionIcon>
    </Hint>
  )
}
