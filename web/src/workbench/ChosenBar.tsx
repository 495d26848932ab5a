/** What can be done to the trainings that are ticked. */
import { Anchor, Button, Group, Menu, Modal, Stack, TagsInput, Text } from '@mantine/core'
import { useDisclosure } from '@mantine/hooks'
import { notifications } from '@mantine/notifications'
import { useQueryClient } from '@tanstack/react-query'
import { useState } from 'react'
import { Link } from 'react-router'
import { $api } from '../api/client'
import { messageOf } from '../api/errors'
import type { ActionName } from '../api/types'
import { IconArrowsDiff, IconDots, IconTag, IconTrash } from '../components/icons'
import { MAX_COMPARED } from '../lib/comparison'
import { plural } from '../lib/format'
import type { TableView } from './view'
import classes from './workbench.module.css'

const DONE: Record<ActionName, string> = {
  stop: 'Stopping',
  resume: 'Resumed',
  repeat: 'Queued the failed runs of',
  star: 'Starred',
  unstar: 'Took the star off',
  archive: 'Archived',
  unarchive: 'Took out of the archive',
  tag: 'Tagged',
  untag: 'Took the tag off',
  delete: 'Deleted',
  restore: 'Restored',
  remove: 'Removed',
}
const UNDO: Partial<Record<ActionName, ActionName>> = {
  delete: 'restore',
  archive: 'unarchive',
  unarchive: 'archive',
}

/** Does something to several trainings, says what came of it, and offers the way back where there is one. */
export function useAct() {
  const client = useQueryClient()
  const { mutateAsync, isPending } = $api.useMutation('post', '/api/workbench/actions', {
    onSettled: () => void client.invalidateQueries(),
  })
  const act = async (action: ActionName, experiments: readonly string[], tag?: string): Promise<boolean> => {
    try {
      const { done, left_out: left } = await mutateAsync({
        body: { action, experiments: [...experiments], ...(tag ? { tag } : {}) },
      })
      const back = UNDO[action]
      const id = notifications.show({
        ...(left.length > 0 ? { color: 'yellow' } : {}),
        autoClose: back ? 12_000 : 5_000,
        message: (
          <Group gap="xs" justify="space-between">
            <span>
              {DONE[action]} {plural(done.length, 'training')}.
              {left.length > 0 && ` ${plural(left.length, 'other')} left out: ${left[0]?.reason}`}
            </span>
            {back && done.length > 0 && (
              <Button
                size="compact-xs"
                variant="light"
                onClick={() => {
                  notifications.hide(id)
                  void act(back, done)
                }}
              >
                Undo
              </Button>
            )}
          </Group>
        ),
      })
      return true
    } catch (error) {
      notifications.show({ color: 'red', title: 'That could not be done', message: messageOf(error) })
      return false
    }
  }
  return { act, busy: isPending }
}

interface ChosenBarProps {
  ticked: readonly string[]
  onTick: (ids: readonly string[]) => void
  view: TableView
}

export function ChosenBar({ ticked, onTick, view }: ChosenBarProps) {
  const { act, busy } = useAct()
  const [tagging, tags] = useDisclosure()
  const [removing, removal] = useDisclosure()
  const client = useQueryClient()
  if (ticked.length === 0) return null
  const tooMany = ticked.length > MAX_COMPARED
  const whole = async () => {
    const project = view.project ? { project: view.project } : {}
    const query = { query: view.query, place: view.place, ...project }
    const found = await client.fetchQuery(
      $api.queryOptions('get', '/api/workbench/ids', { params: { query } }),
    )
    onTick(found.ids)
  }
  const go = async (action: ActionName, leaves = false) => {
    if ((await act(action, ticked)) && leaves) onTick([])
  }
  return (
    <section className={classes.chosen} aria-label="Ticked trainings">
      <strong>{plural(ticked.length, 'training')}</strong>
      <Anchor component="button" type="button" inherit onClick={() => void whole()}>
        Tick all that match
      </Anchor>
      <Anchor component="button" type="button" inherit onClick={() => onTick([])}>
        None
      </Anchor>
      <Group gap={6} ml="auto">
        {view.place === 'trash' ? (
          <>
            <Button
              size="compact-sm"
              variant="default"
              loading={busy}
              onClick={() => void go('restore', true)}
            >
              Restore
            </Button>
            <Button size="compact-sm" color="red" variant="light" onClick={removal.open}>
              Remove for good
            </Button>
          </>
        ) : (
          <>
            {tooMany ? (
              <Button size="compact-sm" disabled title={`At most ${MAX_COMPARED} can be laid side by side`}>
                Compare {ticked.length}
              </Button>
            ) : (
              <Button
                size="compact-sm"
                leftSection={<IconArrowsDiff size={15} />}
                component={Link}
                to={`/compare?${ticked.map((id) => `experiment=${id}`).join('&')}`}
              >
                Compare {ticked.length}
              </Button>
            )}
            <Button
              size="compact-sm"
              variant="default"
              leftSection={<IconTag size={15} />}
              onClick={tags.open}
            >
              Tag
            </Button>
            <Button size="compact-sm" variant="default" loading={busy} onClick={() => void go('stop')}>
              Stop
            </Button>
            <Button size="compact-sm" variant="default" loading={busy} onClick={() => void go('resume')}>
              Resume
            </Button>
            <Menu width={210}>
              <Menu.Target>
                <Button size="compact-sm" variant="default" aria-label="More actions">
                  <IconDots size={15} />
                </Button>
              </Menu.Target>
              <Menu.Dropdown>
                <Menu.Item onClick={() => void go('repeat')}>Repeat failed runs</Menu.Item>
                <Menu.Item onClick={() => void go('star')}>Star</Menu.Item>
                <Menu.Item onClick={() => void go('unstar')}>Take the star off</Menu.Item>
                {view.place === 'archived' ? (
                  <Menu.Item onClick={() => void go('unarchive', true)}>Take out of the archive</Menu.Item>
                ) : (
                  <Menu.Item onClick={() => void go('archive', true)}>Archive</Menu.Item>
                )}
              </Menu.Dropdown>
            </Menu>
            <Button
              size="compact-sm"
              color="red"
              variant="light"
              leftSection={<IconTrash size={15} />}
              loading={busy}
              onClick={() => void go('delete', true)}
            >
              Delete
            </Button>
          </>
        )}
      </Group>
      <TagDialog
        opened={tagging}
        onClose={tags.close}
        onTag={(action, tag) => void act(action, ticked, tag)}
      />
      <Modal
        opened={removing}
        onClose={removal.close}
        title={`Remove ${plural(ticked.length, 'training')} for good?`}
      >
        <Stack>
          <Text size="sm">Their runs, curves and checkpoints are removed now and cannot be taken back.</Text>
          <Group justify="flex-end">
            <Button variant="default" onClick={removal.close}>
              Cancel
            </Button>
            <Button
              color="red"
              onClick={() => {
                removal.close()
                void go('remove', true)
              }}
            >
              Remove
            </Button>
          </Group>
        </Stack>
      </Modal>
    </section>
  )
}

interface TagDialogProps {
  opened: boolean
  onClose: () => void
  onTag: (action: 'tag' | 'untag', tag: string) => void
}

function TagDialog({ opened, onClose, onTag }: TagDialogProps) {
  const [chosen, setChosen] = useState<string[]>([])
  const known = $api.useQuery(
    'get',
    '/api/workbench/values',
    { params: { query: { key: 'tag' } } },
    { enabled: opened },
  )
  const done = (action: 'tag' | 'untag') => {
    for (const tag of chosen) onTag(action, tag)
    setChosen([])
    onClose()
  }
  return (
    <Modal opened={opened} onClose={onClose} title="Tags">
      <Stack>
        <TagsInput
          label="Tags"
          description="Press Enter after each."
          data={known.data ?? []}
          value={chosen}
          maxLength={40}
          data-autofocus
          onChange={setChosen}
        />
        <Group justify="flex-end">
          <Button variant="default" disabled={chosen.length === 0} onClick={() => done('untag')}>
            Take off
          </Button>
          <Button disabled={chosen.length === 0} onClick={() => done('tag')}>
            Put on
          </Button>
        </Group>
      </Stack>
    </Modal>
  )
}
