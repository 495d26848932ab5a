/** The launch form, rendered from the schema that the server derives from its own configuration models. */
import { Anchor, Button, Group, Input, Select, Skeleton, Stack, Text } from '@mantine/core'
import { useEffect, useState } from 'react'
import { useNavigate, useSearchParams } from 'react-router'
import { $api } from '../api/client'
import { ApiError, messageOf } from '../api/errors'
import type { components } from '../api/schema'
import type { Experiment, Preset, ShippedPolicy, StartFrom, StartPolicy } from '../api/types'
import { Below } from '../components/Below'
import { IconRocket } from '../components/icons'
import { ArenaFields, isOfArena } from '../components/launch/ArenaFields'
import { TimeEstimate } from '../components/launch/TimeEstimate'
import { ParallelRunsInput } from '../components/ParallelRuns'
import { useLaunchProject } from '../components/people/useLaunchProject'
import { withSettings } from '../components/recordings/reading'
import { Segments } from '../components/Segments'
import { FIRST_CHOICES, StudySettings } from '../components/studies/StudySettings'
import { Page, Panel, QueryError } from '../components/ui'
import { faultsOf } from '../form/faults'
import { type Field, fieldsOf, withSettingsInTerms } from '../form/layout'
import type { Problems } from '../form/problems'
import { AdvancedFields, FieldGrid, ProblemSummary } from '../form/SchemaForm'
import { SeedsInput } from '../form/SeedsInput'
import { START_FIELD, StartFromInput } from '../form/StartFromInput'
import type { Json, Schema } from '../form/schema'
import { SearchContext, searchedFields, searchFaults, settingsOf, useSearchState } from '../form/search'
import { type Form, useForm } from '../form/useForm'
import { sameValue, valueAt, withValue } from '../form/values'
import { HEADS } from '../heads'
import { arenaFromSearch } from '../lib/arenas'
import { BASE } from '../lib/base'
import { suggestedName } from '../lib/experiments'
import { count, plural } from '../lib/format'
import { useTitle } from '../lib/hooks'
import classes from './NewTrainingPage.module.css'

/** Leaves room for what is added, within the server's 120 characters. */
const LONGEST_COPIED_NAME = 110

const NAME = ['name']
const PARALLEL = ['parallel_runs']

type ExperimentLaunch = components['schemas']['ExperimentLaunch']
type StudyLaunch = components['schemas']['StudyLaunch']

export function NewTrainingPage() {
  useTitle(HEADS.NewTrainingPage.title)
  const [search] = useSearchParams()
  const checkpoint = search.get('checkpoint')
  const start = $api.useQuery(
    'get',
    '/api/checkpoints/{checkpoint_id}/start',
    { params: { path: { checkpoint_id: checkpoint ?? '' } } },
    { enabled: checkpoint !== null, staleTime: Number.POSITIVE_INFINITY },
  )
  const from = search.get('from') ?? start.data?.experiment_id ?? null
  const form = $api.useQuery('get', '/api/training/form', undefined, { staleTime: Number.POSITIVE_INFINITY })
  const original = $api.useQuery(
    'get',
    '/api/experiments/{experiment_id}',
    { params: { path: { experiment_id: from ?? '' } } },
    { enabled: from !== null },
  )
  const shipped = search.get('shipped')
  const like = search.get('policy') ?? shipped
  const policy = $api.useQuery(
    'get',
    '/api/policies/{name}',
    { params: { path: { name: like ?? '' } } },
    { enabled: like !== null, staleTime: Number.POSITIVE_INFINITY },
  )
  const copied = useCopy(original.data, start.data)
  const chosen = search.get('arena')
  const told = search.get('settings')
  const initial =
    from !== null || checkpoint !== null
      ? copied
      : like !== null
        ? likePolicy(policy.data, shipped !== null)
        : withArena(form.data?.defaults, chosen, told)
  const source = from !== null ? original : checkpoint !== null ? start : like !== null ? policy : null
  const error = form.isError ? form.error : (source?.error ?? null)
  const key = checkpoint ?? from ?? (shipped ? `from ${shipped}` : like) ?? chosen ?? told ?? ''

  return (
    <Page {...HEADS.NewTrainingPage}>
      {error && !(form.data && initial) ? (
        <Panel>
          <QueryError
            error={error}
            what={form.isError ? 'form' : like !== null ? 'policy' : 'training'}
            retry={() => {
              void form.refetch()
              if (source) void source.refetch()
            }}
          />
        </Panel>
      ) : !form.data || !initial ? (
        <Panel>
          <Stack aria-busy="true" aria-label="Loading the form">
            {[60, 40, 80, 50].map((width) => (
              <Skeleton key={width} height={34} width={`${width}%`} />
            ))}
          </Stack>
        </Panel>
      ) : (
        <LaunchForm
          key={key}
          draft={`mapless-draft${BASE}:${key}`}
          schema={form.data.schema as Schema}
          defaults={form.data.defaults as unknown as Json}
          initial={initial}
          presets={form.data.presets}
        />
      )}
    </Page>
  )
}

/** The defaults, on the arena that was chosen in the gallery, with what was fitted from a robot's recording. */
function withArena(defaults: unknown, chosen: string | null, told: string | null): Json | undefined {
  if (defaults === undefined) return undefined
  const values = withSettings(defaults as Json, told)
  const arena = arenaFromSearch(chosen)
  const there = arena ? withValue(values, ['training', 'task', 'arena'], arena) : values
  return withValue(there, NAME, suggestedName(valueAt(there, ['training']) ?? null))
}

/** The training that made a shipped policy, from fresh weights or from the policy itself. */
function likePolicy(policy: ShippedPolicy | undefined, further: boolean): Json | undefined {
  if (!policy) return undefined
  const { name, title, seed, training } = policy
  if (!further) return { name: `Like “${title}”`, seeds: [seed], training: training as unknown as Json }
  const start_from: StartFrom = { source: 'shipped', name, title, sha256: null }
  return {
    name: `“${title}”, trained further`,
    seeds: [seed],
    training: { ...training, start_from } as unknown as Json,
  }
}

/**
 * What a duplicate, or a training from a checkpoint, starts with; taken once, since its original may go on while the copy is
 * being edited.
 */
function useCopy(original: Experiment | undefined, start: StartPolicy | undefined): Json | undefined {
  const [copy, setCopy] = useState<Json>()
  if (original && copy === undefined) {
    const { name, runs, training, parallel_runs } = original
    const short = name.slice(0, LONGEST_COPIED_NAME)
    setCopy(
      start
        ? {
            name: `${short}, further`,
            seeds: [0],
            training: { ...training, start_from: start.start_from } as unknown as Json,
          }
        : {
            name: `${short} (copy)`,
            seeds: runs.map((run) => run.seed),
            ...(parallel_runs === null ? {} : { parallel_runs }),
            training: training as unknown as Json,
          },
    )
  }
  return copy
}

/** What is wrong, but for what is not set any more since it is searched. */
function withoutThose(searched: readonly { field: Field }[], faults: Problems): Problems {
  const keys = new Set(searched.map(({ field }) => field.key))
  return Object.fromEntries(Object.entries(faults).filter(([key]) => !keys.has(key)))
}

/** A training without the policy that it begins with: which preset it is has nothing to do with that. */
function fresh(training: Json): Json {
  if (training === null || typeof training !== 'object' || Array.isArray(training)) return training
  const { start_from: _, ...rest } = training
  return rest
}

/** What was typed here before, where it can be read. */
function readDraft(key: string): Json | undefined {
  try {
    const draft: unknown = JSON.parse(sessionStorage.getItem(key) ?? 'null')
    return draft !== null && typeof draft === 'object' ? (draft as Json) : undefined
  } catch {
    return undefined
  }
}

interface LaunchFormProps {
  /** Under which what was typed is kept until it is launched, or this tab is closed. */
  draft: string
  schema: Schema
  defaults: Json
  initial: Json
  presets: readonly Preset[]
}

function LaunchForm({ draft, schema, defaults, initial, presets }: LaunchFormProps) {
  const navigate = useNavigate()
  const [kept] = useState(() => readDraft(draft))
  const state = useForm(kept ?? initial)
  const search = useSearchState(`${draft}:search`)
  const fields = fieldsOf(schema, schema, state.values)
  const searched = searchedFields(search.searched, fields, schema, state.values)
  const settings = settingsOf(searched)
  const isStudy = settings.length > 0
  const typed = fields.filter((field) => !(isStudy && field.key === 'seeds'))
  const faults = {
    ...withoutThose(searched, faultsOf(typed, schema, state.values)),
    ...searchFaults(searched),
  }
  const form = { ...state, problems: { ...state.problems, ...faults } }
  const [pressed, setPressed] = useState(false)
  const faulty = Object.keys(faults).length > 0
  const refused = pressed && faulty ? form.problems : state.problems
  const changed = !sameValue(form.values, initial)
  useEffect(() => {
    if (changed) sessionStorage.setItem(draft, JSON.stringify(form.values))
    else sessionStorage.removeItem(draft)
  }, [draft, changed, form.values])
  useSuggestedName(state)
  const { projects, project, choose } = useLaunchProject()
  const launch = $api.useMutation('post', '/api/experiments', {
    onSuccess: (experiment) => {
      sessionStorage.removeItem(draft)
      return navigate(landing(experiment))
    },
    onError: (error) => {
      if (error instanceof ApiError) form.refuse(error.problems)
    },
  })
  const [choices, setChoices] = useState(FIRST_CHOICES)
  const launchStudy = $api.useMutation('post', '/api/studies', {
    onSuccess: (study) => {
      sessionStorage.removeItem(draft)
      search.clear()
      return navigate(`/studies/${study.id}`)
    },
    onError: (error) => {
      if (error instanceof ApiError) form.refuse(error.problems)
    },
  })
  const launched = isStudy ? launchStudy : launch
  const seeds = fields.find((field) => field.key === 'seeds')
  const name = fields.filter((field) => field.key === 'name')
  const main = fields.filter((field) => !field.advanced && field !== seeds && field.key !== 'name')
  const place = main.filter(isOfArena)
  const advanced = fields.filter((field) => field.advanced)
  const shared = { form, root: schema, initial: defaults }

  const training = valueAt(form.values, ['training']) ?? null
  const preset = presets.find((one) => sameValue(fresh(training), fresh(one.training as unknown as Json)))
  const runs = valueAt(form.values, ['seeds'])
  const steps = valueAt(training, ['steps'])
  const parallel = valueAt(form.values, PARALLEL)
  const otherError =
    launched.error && !(launched.error instanceof ApiError && launched.error.problems.length > 0)
  const into = project === undefined ? {} : { project_id: project }

  return (
    <form
      className={classes.layout}
      aria-label="New training"
      onSubmit={(event) => {
        event.preventDefault()
        setPressed(true)
        if (faulty) return
        const values = form.values as unknown as ExperimentLaunch
        if (isStudy) {
          const { seeds, ...rest } = choices
          const tuning = Array.from({ length: seeds }, (_, seed) => seed)
          const study = {
            name: values.name,
            training: values.training,
            settings,
            seeds: tuning,
            ...rest,
            ...into,
          }
          launchStudy.mutate({ body: study as StudyLaunch })
        } else launch.mutate({ body: { ...values, ...into } })
      }}
    >
      <SearchContext value={search}>
        <Stack gap="md" className={classes.fields}>
          {kept && changed && (
            <Text size="sm" c="dimmed">
              As you left it.{' '}
              <Anchor component="button" type="button" inherit onClick={() => form.replace(initial)}>
                Start over
              </Anchor>
            </Text>
          )}
          <ProblemSummary
            fields={[...withSettingsInTerms(fields, schema, state.values), START_FIELD]}
            problems={refused}
            root={schema}
          />
          <Panel>
            <Stack gap="lg">
              <FieldGrid fields={name} {...shared} />
              <div>
                <Input.Label labelElement="div" id="preset-label" mb={2} display="block">
                  Settings
                </Input.Label>
                <Segments
                  aria-labelledby="preset-label"
                  className={classes.presets}
                  data={[
                    ...presets.map(({ id, title }) => ({ value: id, label: title })),
                    ...(preset ? [] : [{ value: 'own', label: 'Your settings' }]),
                  ]}
                  value={preset?.id ?? 'own'}
                  onChange={(id) => {
                    const chosen = presets.find((one) => one.id === id)
                    if (!chosen) return
                    const start = valueAt(training, ['start_from'])
                    const settings = chosen.training as unknown as Json
                    form.set(['training'], start ? withValue(settings, ['start_from'], start) : settings)
                  }}
                />
                <Text size="xs" c="dimmed" mt={6} mih={18}>
                  {preset?.description ??
                    'Changed by you; choosing a preset again sets the settings below back to it.'}
                </Text>
              </div>
              <StartFromInput form={form} />
              <ArenaFields fields={place} {...shared} />
              <Below height={700}>
                <FieldGrid fields={main.filter((field) => !isOfArena(field))} {...shared} />
              </Below>
            </Stack>
          </Panel>
          <AdvancedFields fields={advanced} refused={refused} {...shared} />
        </Stack>
      </SearchContext>
      <aside className={classes.launch}>
        <Panel>
          <Stack gap="md">
            {projects.length > 1 && (
              <Select
                label="Project"
                allowDeselect={false}
                searchable
                data={projects.map(({ id, name }) => ({ value: id, label: name }))}
                value={project ?? null}
                onChange={(value) => value && choose(value)}
              />
            )}
            {isStudy ? (
              <StudySettings settings={settings.length} choices={choices} onChange={setChoices} />
            ) : (
              seeds && <SeedsInput key={Array.isArray(runs) ? 'list' : 'none'} field={seeds} form={form} />
            )}
            {!isStudy && Array.isArray(runs) && runs.length > 1 && (
              <ParallelRunsInput
                value={typeof parallel === 'number' ? parallel : null}
                onChange={(number) => form.set(PARALLEL, number)}
              />
            )}
            <Text size="sm" className={classes.sum} data-testid="launch-summary">
              {isStudy && typeof steps === 'number'
                ? `At most ${plural(choices.trials * choices.seeds, 'run')} of ${count(steps)} steps, and five more for the best`
                : Array.isArray(runs) && typeof steps === 'number'
                  ? `${plural(runs.length, 'run')} of ${count(steps)} steps`
                  : ' '}
            </Text>
            <TimeEstimate
              training={training}
              runs={isStudy ? choices.trials * choices.seeds : Array.isArray(runs) ? runs.length : 0}
            />
            {otherError && (
              <Text size="sm" c="red" role="alert">
                Not launched: {messageOf(launched.error)}
              </Text>
            )}
            <Group>
              <Button
                type="submit"
                fullWidth
                size="md"
                leftSection={<IconRocket size={18} />}
                loading={launched.isPending}
              >
                {isStudy ? 'Launch the study' : 'Launch'}
              </Button>
            </Group>
          </Stack>
        </Panel>
      </aside>
    </form>
  )
}

/** A training whose name nobody has chosen is called by its settings, whatever they become. */
function useSuggestedName({ values, set }: Form): void {
  const arena = (key: string) => valueAt(values, ['training', 'task', 'arena', key])
  const imported = arena('name') === 'imported'
  const { data: arenas } = $api.useQuery('get', '/api/arenas', undefined, { enabled: imported })
  const place = imported ? arenas?.find(({ key }) => key === arena('sha256'))?.title : undefined
  const suggested = suggestedName(valueAt(values, ['training']) ?? null, place)
  const name = valueAt(values, NAME)
  const [last, setLast] = useState(suggested)
  useEffect(() => {
    if (suggested === last) return
    if (name === last) set(NAME, suggested)
    setLast(suggested)
  }, [suggested, last, name, set])
}

/** A single run is what one wants to watch; several are looked at together. */
function landing({ id, runs }: Experiment): string {
  const [only] = runs
  return only && runs.length === 1 ? `/runs/${only.id}` : `/experiments/${id}`
}
