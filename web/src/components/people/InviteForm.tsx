/** Makes a link by which somebody joins. */
import { Button, Group, NumberInput, Select, Stack, TextInput } from '@mantine/core'
import { useState } from 'react'
import { $api } from '../../api/client'
import type { Project, Role } from '../../api/types'
import { at } from '../../lib/base'
import { Secret } from './Secret'
import { useChange } from './useChange'

/** What stands for the installation's administrators among the roles. */
const ADMINISTRATOR = 'administrator'

interface InviteFormProps {
  /** That somebody may be invited to. */
  projects: readonly Project[]
  /** Whether administrators of the installation may be invited. */
  administrators?: boolean
}

export function InviteForm({ projects, administrators = false }: InviteFormProps) {
  const change = useChange()
  const invite = $api.useMutation('post', '/api/invitations', change('make the link'))
  const [project, setProject] = useState(projects[0]?.id ?? '')
  const [role, setRole] = useState<string>('viewer')
  const [note, setNote] = useState('')
  const [days, setDays] = useState<number>(7)
  const [link, setLink] = useState<string>()
  const admin = role === ADMINISTRATOR
  return (
    <Stack gap="sm">
      <Group
        component="form"
        align="end"
        gap="sm"
        onSubmit={(event) => {
          event.preventDefault()
          const body = {
            project_id: admin ? null : project,
            role: admin ? ('viewer' as const) : (role as Role),
            admin,
            note,
            days,
          }
          invite.mutate(
            { body },
            { onSuccess: ({ path }) => setLink(new URL(at(path), window.location.origin).href) },
          )
        }}
      >
        {projects.length > 1 && !admin && (
          <Select
            label="Project"
            allowDeselect={false}
            data={projects.map(({ id, name }) => ({ value: id, label: name }))}
            value={project}
            onChange={(value) => setProject(value ?? '')}
          />
        )}
        <Select
          label="As"
          allowDeselect={false}
          data={['viewer', 'editor', 'admin', ...(administrators ? [ADMINISTRATOR] : [])]}
          value={role}
          onChange={(value) => setRole(value ?? 'viewer')}
        />
        <TextInput
          label="For whom"
          maxLength={120}
          value={note}
          onChange={(event) => setNote(event.currentTarget.value)}
        />
        <NumberInput
          label="Days"
          min={1}
          max={30}
          w={90}
          value={days}
          onChange={(value) => setDays(typeof value === 'number' ? value : 7)}
        />
        <Button type="submit" loading={invite.isPending} disabled={!admin && project === ''}>
          Make a link
        </Button>
      </Group>
      {link && <Secret title="Send this link" text={link} onClose={() => setLink(undefined)} />}
    </Stack>
  )
}
