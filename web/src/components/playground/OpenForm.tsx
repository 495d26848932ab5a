/** Which policy is to drive where. */
import { Button, Group, Select, Stack } from '@mantine/core'
import { useState } from 'react'
import { useNavigate, useSearchParams } from 'react-router'
import { $api } from '../../api/client'
import { messageOf } from '../../api/errors'
import type { ArenaConfig } from '../../api/types'
import { DifficultySlider } from '../DifficultySlider'
import { isFamily, policyKey, policyOf } from '../evaluations/choices'
import { Notice } from '../ui'

const OWN = 'own'
const FOR_GOOD = { staleTime: Number.POSITIVE_INFINITY }

export function OpenForm() {
  const [search] = useSearchParams()
  const navigate = useNavigate()
  const given = search.get('policy')
  const [policy, setPolicy] = useState(given && policyOf(given) ? given : null)
  const [arena, setArena] = useState(OWN)
  const [difficulty, setDifficulty] = useState(0.5)
  const shipped = $api.useQuery('get', '/api/policies', {}, FOR_GOOD)
  const uploads = $api.useQuery('get', '/api/uploads', { params: { query: { limit: 200 } } })
  const arenas = $api.useQuery('get', '/api/arenas')
  const open = $api.useMutation('post', '/api/playgrounds')

  const ready = (shipped.data ?? []).map((each) => ({
    value: policyKey('shipped', each.name),
    label: each.title,
  }))
  const sent = (uploads.data?.items ?? []).map((each) => ({
    value: policyKey('uploaded', each.id),
    label: each.name,
  }))
  const known = [...ready, ...sent].some(({ value }) => value === policy)
  const chosen = arena === OWN ? null : (JSON.parse(arena) as ArenaConfig)
  return (
    <Stack
      component="form"
      gap="sm"
      onSubmit={(event) => {
        event.preventDefault()
        const asked = policy === null ? null : policyOf(policy)
        if (!asked || asked.source === 'training' || asked.source === 'baseline') return
        open.mutate(
          {
            body: { policy: asked, arena: chosen && isFamily(chosen) ? { ...chosen, difficulty } : chosen },
          },
          { onSuccess: (ground) => navigate(`/playground/${ground.id}`) },
        )
      }}
    >
      <Group align="flex-start" gap="md" grow preventGrowOverflow={false} wrap="wrap">
        <Select
          label="Policy"
          description="Checkpoints are opened from their run's page."
          placeholder="Search shipped and uploaded policies"
          miw={260}
          searchable
          nothingFoundMessage="Nothing by that name"
          value={policy}
          onChange={setPolicy}
          data={[
            ...(policy !== null && !known
              ? [{ group: 'Chosen', items: [{ value: policy, label: policy.replace(':', ' ') }] }]
              : []),
            { group: 'Shipped', items: ready },
            { group: 'Uploaded', items: sent },
          ]}
        />
        <Select
          label="Arena"
          description="Everything in it can be moved afterwards."
          miw={260}
          searchable
          allowDeselect={false}
          nothingFoundMessage="No arena by that name"
          value={arena}
          onChange={(next) => setArena(next ?? OWN)}
          data={[
            { value: OWN, label: "The policy's own" },
            ...(['fixed', 'generated', 'imported'] as const).map((kind) => ({
              group: { fixed: 'Built in', generated: 'Generated', imported: 'Imported' }[kind],
              items: (arenas.data ?? [])
                .filter((each) => each.kind === kind)
                .map((each) => ({ value: JSON.stringify(each.config), label: each.title })),
            })),
          ]}
        />
      </Group>
      {chosen && isFamily(chosen) && (
        <DifficultySlider label="Difficulty" value={difficulty} onChange={setDifficulty} />
      )}
      {open.error && (
        <Notice title="Not opened" bad role="alert">
          {messageOf(open.error)}
        </Notice>
      )}
      <Group>
        <Button type="submit" disabled={policy === null} loading={open.isPending}>
          Let it drive
        </Button>
      </Group>
    </Stack>
  )
}
