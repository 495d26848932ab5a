/** What can be done to an experiment: a menu, with the dialogs that it needs. */
import { ActionIcon, Button, Group, Menu, Modal, Stack, TextInput } from '@mantine/core'
import { useDisclosure } from '@mantine/hooks'
import { useState } from 'react'
import { Link } from 'react-router'
import { useActions } from '../api/actions'
import type { ListedExperiment } from '../api/types'
import { at } from '../lib/base'
import { plural } from '../lib/format'
import { DeleteDialog } from './DeleteDialog'
import {
  IconCopy,
  IconDots,
  IconDownload,
  IconPencil,
  IconPlayerPlay,
  IconPlayerStop,
  IconTrash,
} from './icons'
import { canResume, canStop } from './states'

interface ExperimentMenuProps {
  experiment: Pick<ListedExperiment, 'id' | 'name' | 'states' | 'runs'>
  /** The run whose data are exported; those of all runs without it. */
  runId?: string
  /** Called once the experiment is gone. */
  onDeleted?: () => void
}

/** A button until it is pressed for the first time: a list has many, and hardly any is ever opened. */
export function ExperimentMenu(props: ExperimentMenuProps) {
  const [used, setUsed] = useState(false)
  if (used) return <OpenedMenu {...props} />
  return (
    <ActionIcon
      variant="subtle"
      color="gray"
      aria-haspopup="menu"
      aria-label={`Actions for ${props.experiment.name}`}
      onClick={() => setUsed(true)}
    >
      <IconDots size={18} stroke={1.6} />
    </ActionIcon>
  )
}

function OpenedMenu({ experiment, runId, onDeleted }: ExperimentMenuProps) {
  const { id, name, states } = experiment
  const actions = useActions()
  const [renaming, rename] = useDisclosure()
  const [deleting, remove] = useDisclosure()
  const of = { params: { path: { experiment_id: id } } }
  return (
    <>
      <Menu defaultOpened width={260}>
        <Menu.Target>
          <ActionIcon variant="subtle" color="gray" aria-label={`Actions for ${name}`}>
            <IconDots size={18} stroke={1.6} />
          </ActionIcon>
        </Menu.Target>
        <Menu.Dropdown>
          <Menu.Item leftSection={<IconCopy size={16} />} component={Link} to={`/new?from=${id}`}>
            Duplicate
          </Menu.Item>
          <Menu.Item leftSection={<IconPencil size={16} />} onClick={rename.open}>
            Rename
          </Menu.Item>
          <Menu.Item
            leftSection={<IconPlayerStop size={16} />}
            disabled={!canStop(states)}
            onClick={() => actions.stopExperiment.mutate(of)}
          >
            Stop
          </Menu.Item>
          <Menu.Item
            leftSection={<IconPlayerPlay size={16} />}
            disabled={!canResume(states)}
            onClick={() => actions.resumeExperiment.mutate(of)}
          >
            Resume
          </Menu.Item>
          <Menu.Divider />
          <ExportItems path={runId ? `/api/runs/${runId}` : `/api/experiments/${id}`} />
          <Menu.Divider />
          <Menu.Item c="red" leftSection={<IconTrash size={16} />} onClick={remove.open}>
            Delete
          </Menu.Item>
        </Menu.Dropdown>
      </Menu>
      <RenameDialog
        key={`${renaming}`}
        opened={renaming}
        name={name}
        onClose={rename.close}
        onRename={(next) =>
          actions.renameExperiment.mutate({ ...of, body: { name: next } }, { onSuccess: rename.close })
        }
        busy={actions.renameExperiment.isPending}
      />
      <DeleteDialog
        opened={deleting}
        what={`“${name}”`}
        busy={actions.deleteExperiment.isPending}
        onClose={remove.close}
        onDelete={() =>
          actions.deleteExperiment.mutate(of, {
            onSuccess: () => {
              remove.close()
              onDeleted?.()
            },
          })
        }
      >
        Its {plural(experiment.runs, 'run')}, curves and checkpoints lie in the trash for a week, from where
        they can be taken back. Runs that are going on are stopped.
      </DeleteDialog>
    </>
  )
}

const FORMATS = [
  { format: 'csv', label: 'Curves, CSV' },
  { format: 'parquet', label: 'Curves, Parquet' },
  { format: 'tensorboard', label: 'Curves, TensorBoard' },
  { format: 'json', label: 'Settings and episodes, JSON' },
]

function ExportItems({ path }: { path: string }) {
  return (
    <>
      <Menu.Label>Export</Menu.Label>
      {FORMATS.map(({ format, label }) => (
        <Menu.Item
          key={format}
          leftSection={<IconDownload size={16} />}
          component="a"
          href={at(`${path}/export?format=${format}`)}
          download
        >
          {label}
        </Menu.Item>
      ))}
    </>
  )
}

interface RenameDialogProps {
  opened: boolean
  name: string
  busy: boolean
  onClose: () => void
  onRename: (name: string) => void
}

function RenameDialog({ opened, name, busy, onClose, onRename }: RenameDialogProps) {
  const [text, setText] = useState(name)
  return (
    <Modal opened={opened} onClose={onClose} title="Rename">
      <form
        onSubmit={(event) => {
          event.preventDefault()
          onRename(text)
        }}
      >
        <Stack>
          <TextInput
            label="Name"
            value={text}
            maxLength={120}
            data-autofocus
            onChange={(event) => setText(event.currentTarget.value)}
          />
          <Group justify="flex-end">
            <Button variant="default" onClick={onClose}>
              Cancel
            </Button>
            <Button type="submit" loading={busy} disabled={text.trim() === ''}>
              Rename
            </Button>
          </Group>
        </Stack>
      </form>
    </Modal>
  )
}
