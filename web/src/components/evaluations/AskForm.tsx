/** Which policies are to be measured on which suites. */
import { Button, Group, MultiSelect, Stack } from '@mantine/core'
import { useDebouncedValue } from '@mantine/hooks'
import { keepPreviousData, useQueries } from '@tanstack/react-query'
import { useState } from 'react'
import { useSearchParams } from 'react-router'
import { $api } from '../../api/client'
import { refusalOf } from '../../api/errors'
import type { ArenaConfig } from '../../api/types'
import { plural, words } from '../../lib/format'
import { DifficultySlider } from '../DifficultySlider'
import { useChange } from '../people/useChange'
import { Notice } from '../ui'
import {
  BASELINES,
  isFamily,
  OWN,
  policyKey,
  policyOf,
  suiteByName,
  suiteInArena,
  suiteOf,
  suiteOfOnesOwn,
  suiteTitle,
} from './choices'

const FOR_GOOD = { staleTime: Number.POSITIVE_INFINITY }

interface Option {
  value: string
  label: string
}

/** The chosen ones that no list has yet: they came with the address. */
function strangers(
  chosen: readonly string[],
  known: readonly Option[],
  label: (key: string) => string,
): Option[] {
  const values = new Set(known.map(({ value }) => value))
  return chosen.filter((value) => !values.has(value)).map((value) => ({ value, label: label(value) }))
}

const CHECKPOINT = 'checkpoint:'

/** "crowd"; a checkpoint, until its name has come, as such. */
function nameOf(key: string, checkpoints: ReadonlyMap<string, string>): string {
  return key.startsWith(CHECKPOINT)
    ? (checkpoints.get(key) ?? 'A checkpoint')
    : key.slice(key.indexOf(':') + 1)
}

/** What the chosen checkpoints are called: "Two rooms, seed 1, step 40 000", by key. */
function useCheckpointNames(keys: readonly string[]): ReadonlyMap<string, string> {
  const wanted = keys.filter((key) => key.startsWith(CHECKPOINT))
  return useQueries({
    queries: wanted.map((key) =>
      $api.queryOptions(
        'get',
        '/api/checkpoints/{checkpoint_id}/start',
        { params: { path: { checkpoint_id: key.slice(CHECKPOINT.length) } } },
        FOR_GOOD,
      ),
    ),
    combine: (found) =>
      new Map(wanted.map((key, index) => [key, found[index]?.data?.start_from.title ?? 'A checkpoint'])),
  })
}

/** "maze, difficulty 0.5". */
function groundOf(key: string, difficulty: number): string {
  const suite = suiteOf(key, difficulty)
  return suite ? suiteTitle(suite) : key
}

export function AskForm() {
  const [search] = useSearchParams()
  const { onSettled } = useChange()('ask for these evaluations')
  const [policies, setPolicies] = useState(() =>
    search.getAll('policy').filter((key) => policyOf(key) !== null),
  )
  const [suites, setSuites] = useState(() =>
    search.getAll('suite').filter((key) => suiteOf(key, 0.5) !== null),
  )
  const [difficulty, setDifficulty] = useState(() => {
    const family = search.getAll('suite').flatMap((key) => {
      const suite = suiteOf(key, 0.5)
      const asked = key.startsWith('arena:') && suite ? (JSON.parse(key.slice(6)) as ArenaConfig) : null
      return asked && isFamily(asked) ? [asked.difficulty] : []
    })
    return family[0] ?? 0.5
  })
  const [typed, setTyped] = useState('')
  const [wanted] = useDebouncedValue(typed, 200)
  const shipped = $api.useQuery('get', '/api/policies', {}, FOR_GOOD)
  const uploads = $api.useQuery('get', '/api/uploads', { params: { query: { limit: 200 } } })
  const boards = $api.useQuery('get', '/api/leaderboards')
  const arenas = $api.useQuery('get', '/api/arenas')
  const together = $api.useQuery('get', '/api/suites')
  const trainings = $api.useQuery(
    'get',
    '/api/experiments',
    { params: { query: { limit: 30, ...(wanted ? { query: JSON.stringify(wanted) } : {}) } } },
    { placeholderData: keepPreviousData },
  )
  const checkpoints = useCheckpointNames(policies)
  const ask = $api.useMutation('post', '/api/evaluations', { onSettled })

  const own: Option[] = (trainings.data?.items ?? []).map((each) => ({
    value: policyKey('training', each.id),
    label: each.name,
  }))
  const sent: Option[] = (uploads.data?.items ?? []).map((each) => ({
    value: policyKey('uploaded', each.id),
    label: each.name,
  }))
  const ready: Option[] = (shipped.data ?? []).map((each) => ({
    value: policyKey('shipped', each.name),
    label: each.title,
  }))
  const untrained: Option[] = BASELINES.map((name) => ({
    value: policyKey('baseline', name),
    label: words(name),
  }))
  // A suite that has changed since has a board of each of its contents; measured is the one of today.
  const frozen: Option[] = [
    ...new Set((boards.data?.suites ?? []).filter((each) => each.frozen).map((each) => each.suite)),
  ].map((name) => ({ value: suiteByName(name), label: name }))
  const places = (kind: 'generated' | 'imported' | 'fixed'): Option[] =>
    (arenas.data ?? [])
      .filter((each) => each.kind === kind)
      .map((each) => ({ value: suiteInArena(each.config), label: each.title }))
  const ofOnesOwn: Option[] = (together.data ?? [])
    .filter(({ scenarios }) => scenarios.length > 0)
    .map(({ id, name }) => ({ value: suiteOfOnesOwn(id), label: name }))
  const known = [...own, ...sent, ...ready, ...untrained]
  const grounds = [...ofOnesOwn, ...frozen, ...places('generated'), ...places('imported'), ...places('fixed')]
  const families = suites.some((key) => {
    const suite = suiteOf(key, difficulty)
    return suite?.by === 'arena' && isFamily(suite.arena)
  })
  const many = policies.length * Math.max(1, suites.length)

  return (
    <Stack
      component="form"
      gap="sm"
      onSubmit={(event) => {
        event.preventDefault()
        ask.mutate(
          {
            body: {
              policies: policies.flatMap((key) => policyOf(key) ?? []),
              suites: (suites.length > 0 ? suites : [OWN]).flatMap((key) => suiteOf(key, difficulty) ?? []),
            },
          },
          { onSuccess: () => setPolicies([]) },
        )
      }}
    >
      <Group align="flex-start" gap="md" grow preventGrowOverflow={false} wrap="wrap">
        <MultiSelect
          label="Policies"
          description="A training stands for the best checkpoint of each of its runs."
          placeholder={policies.length === 0 ? 'Search trainings, shipped policies, baselines' : undefined}
          miw={260}
          searchable
          clearable
          nothingFoundMessage="Nothing by that name"
          maxDropdownHeight={320}
          searchValue={typed}
          onSearchChange={setTyped}
          value={policies}
          onChange={setPolicies}
          data={[
            { group: 'Chosen', items: strangers(policies, known, (key) => nameOf(key, checkpoints)) },
            { group: 'Your trainings', items: own },
            { group: 'Uploaded', items: sent },
            { group: 'Shipped', items: ready },
            { group: 'Untrained', items: untrained },
          ]}
        />
        <MultiSelect
          label="On"
          description="Each suite has its own scenarios, the same for all. Empty: each policy's own suite."
          placeholder={suites.length === 0 ? "Each policy's own suite" : undefined}
          miw={260}
          searchable
          clearable
          nothingFoundMessage="No suite or arena by that name"
          maxDropdownHeight={320}
          value={suites}
          onChange={setSuites}
          data={[
            {
              group: 'Chosen',
              items: strangers(suites, [{ value: OWN, label: '' }, ...grounds], (key) =>
                groundOf(key, difficulty),
              ),
            },
            { group: 'Of the policy', items: [{ value: OWN, label: "The policy's own suite" }] },
            { group: 'Suites of your own', items: ofOnesOwn },
            { group: 'Frozen suites', items: frozen },
            { group: 'Generated families', items: places('generated') },
            { group: 'Imported arenas', items: places('imported') },
            { group: 'Built-in arenas', items: places('fixed') },
          ]}
        />
      </Group>
      {families && (
        <DifficultySlider label="Difficulty of families" value={difficulty} onChange={setDifficulty} />
      )}
      {ask.error && (
        <Notice title="Not asked for" bad role="alert">
          {refusalOf(ask.error)}
        </Notice>
      )}
      <Group gap="sm">
        <Button type="submit" disabled={policies.length === 0} loading={ask.isPending}>
          {policies.length === 0 ? 'Evaluate' : `Evaluate, ${plural(many, 'time')}`}
        </Button>
      </Group>
    </Stack>
  )
}
