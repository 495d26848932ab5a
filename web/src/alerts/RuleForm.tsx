/** Makes a rule: of what, above what, where, and how it is told. */
import { Button, Group, NumberInput, Select, Stack, TextInput } from '@mantine/core'
import { useState } from 'react'
import { useAccount } from '../api/account'
import { $api } from '../api/client'
import type { AlertRule } from '../api/types'
import { Secret } from '../components/people/Secret'
import { useChange } from '../components/people/useChange'
import { CHANNELS, EVENTS, FORMATS, THRESHOLDS } from './wording'

export function RuleForm() {
  const settle = useChange()
  const { data: account } = useAccount()
  const channels = $api.useQuery('get', '/api/alerts/channels')
  const projects = $api.useQuery('get', '/api/projects', { params: { query: { limit: 200 } } })
  const make = $api.useMutation('post', '/api/alerts/rules', settle('make the rule'))
  const [event, setEvent] = useState<AlertRule['event']>('ended')
  const [level, setLevel] = useState<number>()
  const [project, setProject] = useState<string | null>(null)
  const [channel, setChannel] = useState<AlertRule['channel']>('browser')
  const [target, setTarget] = useState('')
  const [format, setFormat] = useState<AlertRule['format']>('json')
  const [secret, setSecret] = useState<string>()
  const threshold = THRESHOLDS[event]
  const own = channels.data?.chooses_address === false ? channels.data.own_address : null
  const address = channel === 'mail' ? (own ?? target) : target
  const submit = () =>
    make.mutate(
      {
        body: {
          event,
          channel,
          format,
          threshold: threshold ? (level ?? threshold.start) * threshold.scale : null,
          project_id: event === 'disk' ? null : project,
          target: channel === 'browser' ? null : address.trim(),
        },
      },
      {
        onSuccess: (rule) => {
          setTarget('')
          setSecret(rule.secret ?? undefined)
        },
      },
    )
  return (
    <Stack gap="sm">
      <Group
        component="form"
        align="end"
        gap="sm"
        onSubmit={(submitted) => {
          submitted.preventDefault()
          submit()
        }}
      >
        <Select
          label="When"
          allowDeselect={false}
          w={220}
          data={EVENTS.filter(({ value }) => value !== 'disk' || account?.administrates)}
          value={event}
          onChange={(value) => {
            setEvent((value ?? 'ended') as AlertRule['event'])
            setLevel(undefined)
          }}
        />
        {threshold && (
          <NumberInput
            label={threshold.label}
            w={120}
            min={threshold.min}
            max={threshold.max}
            value={level ?? threshold.start}
            onChange={(value) => setLevel(typeof value === 'number' ? value : undefined)}
          />
        )}
        {event !== 'disk' && (projects.data?.items.length ?? 0) > 1 && (
          <Select
            label="In"
            placeholder="Every project"
            clearable
            w={170}
            data={projects.data?.items.map(({ id, name }) => ({ value: id, label: name })) ?? []}
            value={project}
            onChange={setProject}
          />
        )}
        <Select
          label="Tell"
          allowDeselect={false}
          w={140}
          data={CHANNELS.map((one) => ({ ...one, disabled: one.value === 'mail' && !channels.data?.mail }))}
          value={channel}
          onChange={(value) => setChannel((value ?? 'browser') as AlertRule['channel'])}
        />
        {channel === 'webhook' && (
          <Select
            label="Format"
            allowDeselect={false}
            w={150}
            data={FORMATS}
            value={format}
            onChange={(value) => setFormat((value ?? 'json') as AlertRule['format'])}
          />
        )}
        {channel !== 'browser' && (
          <TextInput
            label={channel === 'mail' ? 'Address' : 'URL'}
            placeholder={channel === 'mail' ? 'name@example.org' : 'https://'}
            type={channel === 'mail' ? 'email' : 'url'}
            w={260}
            maxLength={2000}
            readOnly={channel === 'mail' && own !== null}
            value={address}
            onChange={(changed) => setTarget(changed.currentTarget.value)}
          />
        )}
        <Button
          type="submit"
          loading={make.isPending}
          disabled={channel !== 'browser' && address.trim() === ''}
        >
          Add
        </Button>
      </Group>
      {secret && (
        <Secret
          title="What is sent is signed with this secret (HMAC-SHA256, header Mapless-Signature)"
          text={secret}
          onClose={() => setSecret(undefined)}
        />
      )}
    </Stack>
  )
}
