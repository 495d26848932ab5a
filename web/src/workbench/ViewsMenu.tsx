/** Views of the table under a name: opened, saved, removed; the address of each can be passed on. */
import { ActionIcon, Button, Group, Menu, Modal, TextInput } from '@mantine/core'
import { useDisclosure } from '@mantine/hooks'
import { notifications } from '@mantine/notifications'
import { useQueryClient } from '@tanstack/react-query'
import { useState } from 'react'
import { Link } from 'react-router'
import { $api } from '../api/client'
import { messageOf } from '../api/errors'
import { IconBookmark, IconX } from '../components/icons'
import { addressOf, type TableView } from './view'

export function ViewsMenu({ view }: { view: TableView }) {
  const client = useQueryClient()
  const [naming, dialog] = useDisclosure()
  const [name, setName] = useState('')
  const views = $api.useQuery('get', '/api/workbench/views')
  const settle = {
    onError: (error: unknown) =>
      notifications.show({ color: 'red', title: 'That could not be done', message: messageOf(error) }),
    onSettled: () =>
      void client.invalidateQueries({ queryKey: $api.queryOptions('get', '/api/workbench/views').queryKey }),
  }
  const save = $api.useMutation('put', '/api/workbench/views', settle)
  const remove = $api.useMutation('delete', '/api/workbench/views/{view_id}', settle)
  return (
    <>
      <Menu width={260}>
        <Menu.Target>
          <Button variant="default" leftSection={<IconBookmark size={16} />}>
            Views
          </Button>
        </Menu.Target>
        <Menu.Dropdown>
          {views.data?.items.map((saved) => (
            <Group key={saved.id} gap={2} wrap="nowrap">
              <Menu.Item component={Link} to={`/?${saved.address}`}>
                {saved.name}
              </Menu.Item>
              <ActionIcon
                variant="subtle"
                color="gray"
                size="sm"
                aria-label={`Remove the view ${saved.name}`}
                onClick={() => remove.mutate({ params: { path: { view_id: saved.id } } })}
              >
                <IconX size={14} />
              </ActionIcon>
            </Group>
          ))}
          {views.data?.items.length === 0 && <Menu.Label>No view has been saved yet</Menu.Label>}
          <Menu.Divider />
          <Menu.Item component={Link} to="/">
            As usual
          </Menu.Item>
          <Menu.Item onClick={dialog.open}>Save this view …</Menu.Item>
        </Menu.Dropdown>
      </Menu>
      <Modal opened={naming} onClose={dialog.close} title="Save this view">
        <form
          onSubmit={(event) => {
            event.preventDefault()
            save.mutate(
              { body: { name, address: addressOf(view).toString() } },
              {
                onSuccess: () => {
                  setName('')
                  dialog.close()
                },
              },
            )
          }}
        >
          <TextInput
            label="Name"
            description="Everybody who uses this service sees it; one of that name is replaced."
            value={name}
            maxLength={80}
            data-autofocus
            onChange={({ currentTarget }) => setName(currentTarget.value)}
          />
          <Group justify="flex-end" mt="md">
            <Button variant="default" onClick={dialog.close}>
              Cancel
            </Button>
            <Button type="submit" disabled={name.trim() === ''} loading={save.isPending}>
              Save
            </Button>
          </Group>
        </form>
      </Modal>
    </>
  )
}
