import { screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import { experiment, form, policy, status, training } from '../testing/examples'
import { open } from '../testing/render'
import { FakeEventSource, refusal, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const LAUNCHED = { ...experiment, runs: experiment.runs.slice(0, 1) }

function start(routes = {}) {
  return startServer({ 'GET /api/training/form': form, 'POST /api/experiments': LAUNCHED, ...routes })
}

/** What the form starts with: a name from the settings. */
const NAMED = { ...form.defaults, name: 'PPO, simple' }

const sent = (server: ReturnType<typeof start>) => server.changes.at(-1)?.body as typeof form.defaults

test('the defaults can be launched at once, and a single run is then watched', async () => {
  const server = start()
  const { router, user } = open('/new')
  await user.click(await screen.findByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(router.state.location.pathname).toBe('/runs/run1'))
  expect(sent(server)).toEqual(NAMED)
})

test('what is typed and chosen is what is sent', async () => {
  const server = start()
  const { user } = open('/new')
  const name = await screen.findByRole('textbox', { name: 'Name' })
  await user.clear(name)
  await user.type(name, 'Maze')
  await user.click(screen.getByRole('radio', { name: 'Complex' }))
  await user.click(screen.getByRole('radio', { name: 'ResBlock' }))
  const seeds = screen.getByRole('textbox', { name: 'Number of seeds' })
  await user.clear(seeds)
  await user.type(seeds, '5')
  expect(screen.getByTestId('launch-summary')).toHaveTextContent(/5 runs of 300\s000 steps/)
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(server.changes).toHaveLength(1))
  expect(sent(server)).toMatchObject({
    name: 'Maze',
    seeds: [0, 1, 2, 3, 4],
    training: { task: { arena: { name: 'complex' } }, algorithm: { network: { name: 'resblock' } } },
  })
})

test('a branch that was left keeps what was set in it', async () => {
  start()
  const { user } = open('/new')
  await user.click(await screen.findByRole('button', { name: /Advanced/ }))
  const layers = await screen.findByRole('textbox', { name: 'Hidden layers' })
  await user.clear(layers)
  await user.type(layers, '32, 16')
  await user.click(screen.getByRole('radio', { name: 'ResBlock' }))
  expect(screen.queryByRole('textbox', { name: 'Hidden layers' })).not.toBeInTheDocument()
  await user.click(screen.getByRole('radio', { name: 'MLP' }))
  expect(await screen.findByRole('textbox', { name: 'Hidden layers' })).toHaveValue('32, 16')
})

test('another algorithm starts with its own defaults', async () => {
  const server = start()
  const { user } = open('/new')
  await user.click(await screen.findByRole('radio', { name: 'DDPG' }))
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(server.changes).toHaveLength(1))
  expect(sent(server).training.algorithm).toEqual({
    name: 'ddpg',
    network: { name: 'mlp', hidden_sizes: [128, 128], activation: 'relu' },
    tau: 0.01,
  })
})

test('a preset sets the training and leaves name and seeds; a change of it is called one’s own', async () => {
  const server = start()
  const { user } = open('/new')
  const presets = await screen.findByRole('radiogroup', { name: 'Settings' })
  await user.click(within(presets).getByRole('radio', { name: 'Paper settings' }))
  expect(screen.getByRole('radio', { name: 'ResBlock' })).toBeChecked()
  expect(screen.getByRole('radio', { name: 'Paper' })).toBeChecked()
  await user.click(screen.getByRole('radio', { name: 'Improved' }))
  expect(within(presets).getByRole('radio', { name: 'Your settings' })).toBeChecked()
  await user.click(within(presets).getByRole('radio', { name: 'Default' }))
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(server.changes).toHaveLength(1))
  expect(sent(server)).toEqual(NAMED)
})

test('what the server refuses stands at its field, in the summary, and goes when the field is changed', async () => {
  start({
    'POST /api/experiments': refusal(422, [
      {
        loc: ['body', 'training', 'algorithm', 'ppo', 'learning_rate'],
        msg: 'Input should be less than 0.1',
        type: 'x',
      },
      {
        loc: ['body', 'training', 'algorithm', 'ppo'],
        msg: 'Value error, robots and rate do not fit',
        type: 'value_error',
      },
    ]),
  })
  const { user } = open('/new')
  await user.click(await screen.findByRole('button', { name: /Advanced/ }))
  const rate = await screen.findByRole('textbox', { name: 'Learning rate' })
  await user.clear(rate)
  await user.type(rate, '0.05')
  await user.click(screen.getByRole('button', { name: 'Launch' }))

  const summary = await screen.findByTestId('problems')
  expect(summary).toHaveTextContent('Learning rate: Input should be less than 0.1')
  expect(summary).toHaveTextContent('Algorithm: Robots and rate do not fit')
  expect(rate).toBeInvalid()
  expect(rate).toHaveAccessibleDescription(/Input should be less than 0.1/)

  await user.click(within(summary).getByRole('button', { name: 'Learning rate' }))
  expect(rate).toHaveFocus()
  await user.clear(rate)
  await user.type(rate, '0.01')
  expect(rate).toBeValid()
  expect(screen.queryByTestId('problems')).not.toBeInTheDocument()
})

test('seeds can be chosen one by one', async () => {
  const server = start()
  const { user } = open('/new')
  await user.click(await screen.findByRole('button', { name: 'Choose them' }))
  const seeds = await screen.findByRole('textbox', { name: 'Seeds' })
  await user.clear(seeds)
  await user.type(seeds, '7, 11')
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(server.changes).toHaveLength(1))
  expect(sent(server).seeds).toEqual([7, 11])
})

test('of several seeds as many run at a time as one says', async () => {
  const server = start()
  const { user } = open('/new')
  const seeds = await screen.findByRole('textbox', { name: 'Number of seeds' })
  // A single run needs no limit.
  await user.clear(seeds)
  await user.type(seeds, '1')
  expect(screen.queryByRole('textbox', { name: 'At most at a time' })).not.toBeInTheDocument()
  await user.clear(seeds)
  await user.type(seeds, '5')
  await user.type(await screen.findByRole('textbox', { name: 'At most at a time' }), '2')
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(server.changes).toHaveLength(1))
  expect(sent(server)).toMatchObject({ seeds: [0, 1, 2, 3, 4], parallel_runs: 2 })
})

test('a duplicate runs as many at a time as its original', async () => {
  start({ 'GET /api/experiments/exp1': { ...experiment, parallel_runs: 1 } })
  open('/new?from=exp1')
  expect(await screen.findByRole('textbox', { name: 'At most at a time' })).toHaveValue('1')
})

test('a duplicate starts with the settings, the seeds and the name of its original', async () => {
  const original = { ...experiment, training: { ...training, steps: 5000 } }
  start({ 'GET /api/experiments/exp1': original })
  open('/new?from=exp1')
  expect(await screen.findByRole('textbox', { name: 'Name' })).toHaveValue('Corridor (copy)')
  expect(screen.getByTestId('launch-summary')).toHaveTextContent(/2 runs of 5\s000 steps/)
})

test('a server out of reach loses nothing of what was typed', async () => {
  start({ 'POST /api/experiments': new TypeError('Failed to fetch') })
  const { user } = open('/new')
  const name = await screen.findByRole('textbox', { name: 'Name' })
  await user.clear(name)
  await user.type(name, 'Maze')
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  expect(await screen.findByText('Not launched: The server cannot be reached.')).toBeInTheDocument()
  expect(name).toHaveValue('Maze')
})

test('a training like a policy that ships starts with its settings and its seed', async () => {
  const server = start({
    'GET /api/policies/crowd': { ...policy, training: { ...training, steps: 50_000 } },
  })
  const { user } = open('/new?policy=crowd')
  expect(await screen.findByRole('textbox', { name: 'Name' })).toHaveValue('Like “Crowd”')
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(server.changes).toHaveLength(1))
  expect(sent(server)).toMatchObject({ seeds: [7], training: { steps: 50_000 } })
})

test('a policy that is not there cannot be started from', async () => {
  start()
  open('/new?policy=nobody')
  expect(await screen.findByText('There is no such policy')).toBeInTheDocument()
})

test('a reward is a list of terms: one is added, changed, removed, and another list chosen', async () => {
  const server = start()
  const { user } = open('/new')
  const terms = await screen.findByRole('region', { name: 'Terms' })
  expect(within(terms).getByRole('combobox', { name: 'Reward' })).toHaveValue('Basic')
  await user.click(within(terms).getByRole('button', { name: 'Remove Arrival' }))
  expect(within(terms).getByRole('combobox', { name: 'Reward' })).toHaveValue('Terms of your own')
  const progress = within(terms).getByRole('listitem', { name: 'Progress' })
  expect(within(progress).queryByRole('button', { name: 'Remove Progress' })).toBeDisabled()
  const weight = within(progress).getByRole('textbox', { name: 'Weight' })
  await user.clear(weight)
  await user.type(weight, '250')
  await user.click(within(progress).getByRole('switch', { name: 'Exponential' }))
  await user.click(within(terms).getByRole('button', { name: 'Add a term' }))
  await user.click(await screen.findByRole('menuitem', { name: /Arrival/ }))
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(server.changes).toHaveLength(1))
  expect(sent(server).training.task.reward).toEqual({
    terms: [
      { name: 'progress', weight: 250, exponential: true },
      { name: 'arrival', weight: 120 },
    ],
  })
})

test('what the server refuses of a term stands in its row', async () => {
  start({
    'POST /api/experiments': refusal(422, [
      {
        loc: ['body', 'training', 'task', 'reward', 'terms', 1, 'progress', 'weight'],
        msg: 'too much',
        type: 'less_than',
      },
    ]),
  })
  const { user } = open('/new')
  await user.click(await screen.findByRole('button', { name: 'Launch' }))
  const progress = await screen.findByRole('listitem', { name: 'Progress' })
  expect(await within(progress).findByText('Too much')).toBeInTheDocument()
  const summary = screen.getByTestId('problems')
  await user.click(within(summary).getByRole('button', { name: 'Progress, weight' }))
  expect(within(progress).getByRole('textbox', { name: 'Weight' })).toHaveFocus()
})

test('what was typed is there again after a look elsewhere, until one starts over', async () => {
  start()
  const first = open('/new')
  const name = await screen.findByRole('textbox', { name: 'Name' })
  await first.user.clear(name)
  await first.user.type(name, 'Half done')
  first.unmount()
  const { user } = open('/new')
  expect(await screen.findByRole('textbox', { name: 'Name' })).toHaveValue('Half done')
  await user.click(screen.getByRole('button', { name: 'Start over' }))
  expect(screen.getByRole('textbox', { name: 'Name' })).toHaveValue('PPO, simple')
  expect(screen.queryByText('As you left it.')).not.toBeInTheDocument()
})

test('what was launched is no draft any more', async () => {
  start()
  const first = open('/new')
  await first.user.type(await screen.findByRole('textbox', { name: 'Name' }), ' again')
  await first.user.click(screen.getByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(first.router.state.location.pathname).toBe('/runs/run1'))
  first.unmount()
  open('/new')
  expect(await screen.findByRole('textbox', { name: 'Name' })).toHaveValue('PPO, simple')
})

test('advanced settings are searched by name, heading and description', async () => {
  start()
  const { user } = open('/new')
  await user.click(await screen.findByRole('button', { name: /Advanced/ }))
  await user.type(await screen.findByRole('textbox', { name: 'Search these settings' }), 'hidden lay')
  expect(screen.getByRole('textbox', { name: 'Hidden layers' })).toBeInTheDocument()
  expect(screen.queryByRole('textbox', { name: /Learning rate/ })).not.toBeInTheDocument()
  await user.type(screen.getByRole('textbox', { name: 'Search these settings' }), 'xyz')
  expect(screen.getByText('None of these settings is called so.')).toBeInTheDocument()
})

const START = {
  start_from: {
    source: 'checkpoint',
    name: 'cp2',
    sha256: 'cd'.repeat(32),
    title: 'Corridor, seed 0, step 100 000',
  },
  kind: 'best',
  experiment_id: 'exp1',
  success: null,
}
const SHIPPED = {
  start_from: { source: 'shipped', name: 'simple', sha256: null, title: 'Simple arena' },
  kind: 'shipped',
  experiment_id: null,
  success: null,
}
const STARTS = {
  'GET /api/training/starts': [START, SHIPPED],
  'GET /api/checkpoints/cp2/start': { ...START, kind: 'other' },
  'GET /api/experiments/exp1': experiment,
}

test('a policy to start from is searched for, sent, and taken back', async () => {
  const server = start(STARTS)
  const { user } = open('/new')
  const field = await screen.findByRole('combobox', { name: 'Start from' })
  await user.type(field, 'corr')
  await waitFor(() => expect(server.asked).toContain('/api/training/starts?search=corr'))
  await user.click(await screen.findByRole('option', { name: /Corridor, seed 0, step 100 000/ }))
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(server.changes).toHaveLength(1))
  expect(sent(server).training).toEqual({ ...training, start_from: START.start_from })
})

test('fine-tuning a checkpoint begins with the settings of its training', async () => {
  const server = start(STARTS)
  const { user } = open('/new?checkpoint=cp2')
  expect(await screen.findByRole('textbox', { name: 'Name' })).toHaveValue('Corridor, further')
  expect(screen.getByRole('combobox', { name: 'Start from' })).toHaveValue('Corridor, seed 0, step 100 000')
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(server.changes).toHaveLength(1))
  expect(sent(server)).toMatchObject({ seeds: [0], training: { ...training, start_from: START.start_from } })
})

test('fine-tuning a policy that ships begins with its settings, and a preset leaves the policy as it is', async () => {
  const server = start({ ...STARTS, 'GET /api/policies/simple': policy })
  const { user } = open('/new?shipped=simple')
  expect(await screen.findByRole('combobox', { name: 'Start from' })).toHaveValue(policy.title)
  await user.click(screen.getByRole('radio', { name: 'Paper settings' }))
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(server.changes).toHaveLength(1))
  expect(sent(server).training).toMatchObject({
    task: { observation: 'paper' },
    start_from: { source: 'shipped', name: policy.name },
  })
})

test('a policy that does not fit says so at its field, and its settings can be taken over', async () => {
  const server = start({
    ...STARTS,
    'POST /api/experiments': refusal(422, [
      {
        loc: ['body', 'training', 'start_from'],
        msg: 'Corridor does not fit: its network is mlp',
        type: 'value_error',
      },
    ]),
  })
  const { user } = open('/new?checkpoint=cp2')
  await user.click(await screen.findByRole('radio', { name: 'ResBlock' }))
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  const field = screen.getByRole('combobox', { name: 'Start from' })
  await waitFor(() => expect(field).toBeInvalid())
  expect(field).toHaveAccessibleDescription(/its network is mlp/)
  const summary = screen.getByTestId('problems')
  await user.click(within(summary).getByRole('button', { name: 'Start from' }))
  expect(field).toHaveFocus()
  await user.click(screen.getByRole('button', { name: 'Take over its task, algorithm and network' }))
  await waitFor(() => expect(screen.getByRole('radio', { name: 'MLP' })).toBeChecked())
  expect(field).toBeValid()
  server.routes['POST /api/experiments'] = LAUNCHED
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(server.changes).toHaveLength(2))
  expect(sent(server).training).toEqual({ ...training, start_from: START.start_from })
})

test('what can be set of a part is told in a line, shown when asked for, and never hidden where it was refused', async () => {
  const ticks = structuredClone(form) as unknown as { schema: { $defs: Record<string, unknown> } }
  const reward = ticks.schema.$defs.Reward as { properties: { terms: Record<string, unknown> } }
  reward.properties.terms['x-ticks'] = true
  const server = start({ 'GET /api/training/form': ticks })
  const { user } = open('/new')
  const part = await screen.findByRole('listitem', { name: 'Progress' })
  expect(part).toHaveTextContent('Weight: 500, Exponential: no')
  expect(within(part).queryByRole('textbox')).not.toBeInTheDocument()
  await user.click(within(part).getByRole('button', { name: 'Change: settings of Progress' }))
  const weight = within(part).getByRole('textbox', { name: 'Weight' })
  await user.clear(weight)
  await user.type(weight, '70')
  await user.click(within(part).getByRole('button', { name: 'Done: settings of Progress' }))
  expect(part).toHaveTextContent('Weight: 70')

  server.routes['POST /api/experiments'] = refusal(422, [
    {
      loc: ['body', 'training', 'task', 'reward', 'terms', 1, 'progress', 'weight'],
      msg: 'too much',
      type: 'x',
    },
  ])
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(within(part).getByRole('textbox', { name: 'Weight' })).toBeInvalid())
  await user.click(within(screen.getByTestId('problems')).getByRole('button', { name: 'Progress, weight' }))
  expect(within(part).getByRole('textbox', { name: 'Weight' })).toHaveFocus()
})

test('what is wrong with a value is said beside it as it is typed, and keeps it from being launched', async () => {
  const server = start()
  const { user } = open('/new')
  const steps = await screen.findByRole('textbox', { name: 'Steps' })
  await user.clear(steps)
  expect(steps).toHaveAccessibleDescription(/A whole number is missing/)
  await user.type(steps, '5')
  expect(steps).toHaveAccessibleDescription(/It must be 1\s000 to 1\s000\s000\s000\./)
  expect(screen.queryByTestId('problems')).not.toBeInTheDocument()

  await user.click(screen.getByRole('button', { name: 'Launch' }))
  expect(screen.getByTestId('problems')).toHaveTextContent(/Steps: It must be/)
  expect(server.changes).toHaveLength(0)

  await user.type(steps, '000')
  expect(steps).toBeValid()
  expect(screen.queryByTestId('problems')).not.toBeInTheDocument()
})

test('the name follows the settings until somebody chooses one', async () => {
  start()
  const { user } = open('/new')
  const name = await screen.findByRole('textbox', { name: 'Name' })
  await user.click(screen.getByRole('radio', { name: 'DDPG' }))
  await waitFor(() => expect(name).toHaveValue('DDPG, simple'))
  await user.type(name, ' again')
  await user.click(screen.getByRole('radio', { name: 'PPO' }))
  expect(name).toHaveValue('DDPG, simple again')
})

test('how long it will take is told from the runs like it', async () => {
  start({ 'GET /api/training/pace': { steps_per_second: 10_000, runs: 4 } })
  const { user } = open('/new')
  const workers = status.workers.length
  const estimate = await screen.findByTestId('time-estimate')
  expect(estimate).toHaveTextContent('About 30 s once it begins')
  expect(estimate).toHaveTextContent('as quick as 4 runs like it here')
  const seeds = screen.getByRole('textbox', { name: 'Number of seeds' })
  await user.clear(seeds)
  await user.type(seeds, String(2 * workers))
  await waitFor(() =>
    expect(screen.getByTestId('time-estimate')).toHaveTextContent('About 1 min once it begins'),
  )
})

test('an imported arena is chosen by its name', async () => {
  const sha256 = 'ab'.repeat(32)
  const chosen = structuredClone(form) as unknown as { schema: { $defs: Record<string, unknown> } }
  const arena = chosen.schema.$defs.Arena as { properties: Record<string, unknown> }
  arena.properties.sha256 = { type: 'string', title: 'Imported arena', default: '', 'x-imported-arena': true }
  const imported = { kind: 'imported', key: sha256, title: 'Our lab', config: { name: 'imported', sha256 } }
  const server = start({ 'GET /api/training/form': chosen, 'GET /api/arenas': [imported] })
  const { user } = open('/new')
  const field = await screen.findByRole('combobox', { name: 'Imported arena' })
  expect(field).toHaveAccessibleDescription(/Choose one of the imported arenas/)
  await user.click(field)
  await user.click(await screen.findByRole('option', { name: 'Our lab' }))
  await user.click(screen.getByRole('button', { name: 'Launch' }))
  await waitFor(() => expect(server.changes).toHaveLength(1))
  expect(sent(server)).toMatchObject({ training: { task: { arena: { sha256 } } } })
})
