/** The policies of a run, to take away. */
import { Badge, Button, Group, Table, VisuallyHidden } from '@mantine/core'
import { Link } from 'react-router'
import type { Checkpoint } from '../api/types'
import { at } from '../lib/base'
import { count, dateTime, fileSize, significant } from '../lib/format'
import classes from './ExperimentTable.module.css'
import { evaluate, play, policyKey } from './evaluations/choices'
import { IconDownload } from './icons'
import { SuccessEstimate } from './MeasuredEstimate'
import { Message } from './ui'
import ui from './ui.module.css'

interface CheckpointTableProps {
  checkpoints: readonly Checkpoint[]
  /** Whose episodes are shown. */
  chosen: Checkpoint | undefined
  onChoose: (checkpoint: Checkpoint) => void
  onWatch: (checkpoint: Checkpoint) => void
}

export function CheckpointTable({ checkpoints, chosen, onChoose, onWatch }: CheckpointTableProps) {
  if (checkpoints.length === 0) {
    return (
      <Message title="No checkpoint yet">
        Each evaluation keeps one; the first comes soon after the start.
      </Message>
    )
  }
  return (
    <Table.ScrollContainer type="native" minWidth={320}>
      <Table highlightOnHover className={classes.table} data-testid="checkpoints">
        <Table.Thead>
          <Table.Tr>
            <Table.Th ta="right" className={classes.step}>
              Step
            </Table.Th>
            <Table.Th visibleFrom="sm" w={84} miw={84}>
              <VisuallyHidden>Best</VisuallyHidden>
            </Table.Th>
            <Table.Th>Success, 95 % interval</Table.Th>
            <Table.Th visibleFrom="md" ta="right">
              Steps to target
            </Table.Th>
            <Table.Th visibleFrom="md" ta="right">
              Size
            </Table.Th>
            <Table.Th visibleFrom="xl" ta="right">
              Saved
            </Table.Th>
            <Table.Th className={classes.actions}>
              <VisuallyHidden>Episodes and downloads</VisuallyHidden>
            </Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {checkpoints.map((checkpoint) => (
            <Table.Tr
              key={checkpoint.id}
              data-testid="checkpoint"
              data-best={checkpoint.best || undefined}
              data-ticked={checkpoint.id === chosen?.id || undefined}
            >
              <Table.Td ta="right" fw={550} className={ui.number}>
                {count(checkpoint.step)}
              </Table.Td>
              <Table.Td visibleFrom="sm">
                {checkpoint.best && (
                  <Badge size="sm" variant="light" miw="fit-content">
                    Best
                  </Badge>
                )}
                {checkpoint.goes_at != null && (
                  <Badge
                    size="sm"
                    color="gray"
                    variant="light"
                    miw="fit-content"
                    title={`The rule on the page Storage takes it on ${dateTime(checkpoint.goes_at)}, unless it is kept`}
                  >
                    Goes
                  </Badge>
                )}
                {checkpoint.damaged && (
                  <Badge
                    size="sm"
                    color="red"
                    variant="light"
                    miw="fit-content"
                    title="Its archive is no longer what was stored: the run went on from the one before"
                  >
                    Damaged
                  </Badge>
                )}
              </Table.Td>
              <Table.Td>
                <SuccessEstimate estimate={checkpoint.evaluation?.success ?? null} />
              </Table.Td>
              <Table.Td visibleFrom="md" ta="right" className={ui.number}>
                {checkpoint.evaluation?.steps_mean == null
                  ? '–'
                  : significant(checkpoint.evaluation.steps_mean, 3)}
              </Table.Td>
              <Table.Td
                visibleFrom="md"
                ta="right"
                className={ui.number}
                title={`SHA-256 ${checkpoint.sha256}`}
              >
                {fileSize(checkpoint.size)}
              </Table.Td>
              <Table.Td visibleFrom="xl" ta="right" className={`${ui.number} ${ui.quiet}`}>
                {dateTime(checkpoint.created_at)}
              </Table.Td>
              <Table.Td>
                <Group
                  gap={6}
                  justify="flex-end"
                  className={classes.buttons}
                  display={checkpoint.damaged ? 'none' : undefined}
                >
                  <Button
                    size="compact-sm"
                    variant="default"
                    aria-label={`Watch step ${checkpoint.step}`}
                    onClick={() => onWatch(checkpoint)}
                  >
                    Watch
                  </Button>
                  {checkpoint.evaluation && (
                    <Button
                      size="compact-sm"
                      variant="default"
                      aria-label={`Episodes of step ${checkpoint.step}`}
                      aria-pressed={checkpoint.id === chosen?.id}
                      onClick={() => onChoose(checkpoint)}
                    >
                      Episodes
                    </Button>
                  )}
                  <Button
                    component={Link}
                    to={`/new?checkpoint=${checkpoint.id}`}
                    size="compact-sm"
                    variant="default"
                    title="A training that begins with this policy"
                    aria-label={`Fine-tune step ${checkpoint.step}`}
                  >
                    Fine-tune
                  </Button>
                  <Button
                    component={Link}
                    to={play(policyKey('checkpoint', checkpoint.id))}
                    size="compact-sm"
                    variant="default"
                    aria-label={`Play with step ${checkpoint.step}`}
                  >
                    Play
                  </Button>
                  <Button
                    component={Link}
                    to={evaluate([policyKey('checkpoint', checkpoint.id)])}
                    size="compact-sm"
                    variant="default"
                    aria-label={`Evaluate step ${checkpoint.step} elsewhere`}
                  >
                    Evaluate
                  </Button>
                  <Button
                    component="a"
                    href={at(`/api/checkpoints/${checkpoint.id}/bundle`)}
                    download
                    size="compact-sm"
                    variant="default"
                    title="ONNX, a NumPy runner and a ROS 2 package, checked against the policy: takes a few seconds"
                    aria-label={`Robot bundle of step ${checkpoint.step}`}
                  >
                    Robot bundle
                  </Button>
                  <Button
                    component="a"
                    href={at(`/api/checkpoints/${checkpoint.id}/download`)}
                    download
                    size="compact-sm"
                    variant={checkpoint.best ? 'filled' : 'default'}
                    leftSection={<IconDownload size={14} />}
                    aria-label={`Download step ${checkpoint.step}`}
                  >
                    Download
                  </Button>
                </Group>
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  )
}
