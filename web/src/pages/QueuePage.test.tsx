import { screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import { open } from '../testing/render'
import { FakeEventSource, refusal, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const account = {
  kind: 'owner',
  name: 'owner',
  email: null,
  administrates: true,
  people: false,
  has_password: false,
  may_launch: true,
}
const run = {
  id: 'r1',
  experiment_id: 'e1',
  experiment_name: 'Corridor',
  project_id: 'p1',
  seed: 3,
  algorithm: 'ppo',
  step: 0,
  total_steps: 200_000,
  priority: 0,
  queued_at: 1,
  position: 1,
  waits_for: 'turn',
  parallel_runs: null as number | null,
  extensions: [],
  starts_in: 125,
}
const stuck = { ...run, id: 'r2', seed: 4, position: 2, waits_for: 'gpu', starts_in: null }
const worker = {
  name: 'w@box/0',
  queue: 'gpu',
  last_seen: 1,
  there: true,
  draining: false,
  trouble: null,
  machine: {
    host: 'box',
    cores: 8,
    load: 1.25,
    memory_bytes: 16 * 2 ** 30,
    memory_used_bytes: 4 * 2 ** 30,
    gpu: { name: 'H100', memory_bytes: 80 * 2 ** 30, used_bytes: 20 * 2 ** 30, busy: 0.4 },
  },
  extensions: [],
  busy: true,
  run: {
    id: 'r0',
    experiment_id: 'e1',
    experiment_name: 'Corridor',
    seed: 2,
    progress: 0.25,
    steps_per_second: 24_000,
    seconds_left: 60,
  },
  activity: Array.from({ length: 28 }, (_, index) => (index === 27 ? 1 : 0.5)),
  last_words: null,
}
const gone = {
  ...worker,
  name: 'old@box/1',
  there: false,
  busy: false,
  run: null,
  last_words: 'Attempt 3 was lost: it is silent.',
}
const routes = {
  'GET /api/account': account,
  'GET /api/queue': { items: [run, stuck], total: 2, hidden: 4, jobs: 0 },
  'GET /api/workers': { items: [worker, gone] },
  'GET /api/jobs': { items: [], total: 0, workers: 1 },
}
const done = new Response(null, { status: 204 })

test('each run says what it waits for and until when, or that nobody knows', async () => {
  startServer(routes)
  open('/queue')
  const [first, second] = await screen.findAllByTestId('waiting-run')
  expect(first).toHaveTextContent('Corridor, seed 3')
  expect(first).toHaveTextContent('its turn')
  expect(first).toHaveTextContent('in 2 min 5 s')
  expect(second).toHaveTextContent('a worker with a GPU: none is there')
  expect(second).toHaveTextContent('unknown')
  expect(screen.getByText('and 4 runs of projects that you do not see')).toBeInTheDocument()
})

test('a priority is sent by Enter, and the front is one press away', async () => {
  const server = startServer({
    ...routes,
    'PUT /api/runs/r2/priority': done,
    'POST /api/runs/r2/front': done,
  })
  const { user } = open('/queue')
  const input = await screen.findByRole('textbox', { name: 'Corridor, seed 4: priority' })
  await user.clear(input)
  await user.type(input, '7{Enter}')
  await user.click(screen.getByRole('button', { name: 'Corridor, seed 4: to the front' }))
  expect(server.changes).toEqual([
    { route: 'PUT /api/runs/r2/priority', body: { priority: 7 } },
    { route: 'POST /api/runs/r2/front', body: null },
  ])
  expect(screen.getByRole('button', { name: 'Corridor, seed 3: to the front' })).toBeDisabled()
})

test('Alt and the arrow keys put a run before or after its neighbour', async () => {
  const server = startServer({ ...routes, 'PUT /api/runs/r2/place': done, 'PUT /api/runs/r1/place': done })
  const { user } = open('/queue')
  const handle = (seed: number) =>
    screen.getByRole('button', { name: new RegExp(`seed ${seed}: move in the queue`) })
  await screen.findAllByTestId('waiting-run')
  handle(4).focus()
  await user.keyboard('{ArrowUp}{Alt>}{ArrowDown}{ArrowUp}{/Alt}')
  handle(3).focus()
  await user.keyboard('{Alt>}{ArrowDown}{/Alt}')
  await waitFor(() =>
    expect(server.changes).toEqual([
      { route: 'PUT /api/runs/r2/place', body: { beside: 'r1', side: 'before' } },
      { route: 'PUT /api/runs/r1/place', body: { beside: 'r2', side: 'after' } },
    ]),
  )
})

test('a refused priority is said, and taken back', async () => {
  const said = 'Priorities above 100 take an administrator of the installation.'
  startServer({ ...routes, 'PUT /api/runs/r2/priority': refusal(403, said) })
  const { user } = open('/queue')
  const input = await screen.findByRole('textbox', { name: 'Corridor, seed 4: priority' })
  await user.clear(input)
  await user.type(input, '101{Enter}')
  expect(await screen.findByText(said)).toBeInTheDocument()
  expect(input).toHaveValue('0')
})

test('a limit that a run waits for can be changed where it waits', async () => {
  const waits = { ...stuck, waits_for: 'experiment limit', parallel_runs: 1 }
  const queue = { items: [run, waits], total: 2, hidden: 0, jobs: 0 }
  const server = startServer({ ...routes, 'GET /api/queue': queue, 'PATCH /api/experiments/e1': done })
  const { user } = open('/queue')
  const button = await screen.findByRole('button', { name: 'At most 1 at a time: Corridor' })
  expect(button).toHaveTextContent('At most 1 at a time')
  await user.click(button)
  const number = await screen.findByRole('textbox', { name: 'At most at a time' })
  await user.clear(number)
  await user.type(number, '3{Enter}')
  await waitFor(() =>
    expect(server.changes).toEqual([{ route: 'PATCH /api/experiments/e1', body: { parallel_runs: 3 } }]),
  )
})

test('a worker shows its run, its machine and its week; one that has gone its last words', async () => {
  const server = startServer({ ...routes, 'POST /api/workers/remove': done })
  const { user } = open('/queue')
  const [there, away] = await screen.findAllByTestId('worker')
  if (!there || !away) throw new Error('two workers')
  for (const text of ['Corridor, seed 2', '24k steps/s', 'load 1.3 of 8', '4.0 of 16 GiB', 'H100'])
    expect(there).toHaveTextContent(text)
  expect(within(there).getByRole('img', { name: /^Had a run 51.8/ })).toBeInTheDocument()
  expect(away).toHaveTextContent('Last words: Attempt 3 was lost: it is silent.')
  await user.click(within(away).getByRole('button', { name: 'Actions for old@box/1' }))
  await user.click(await screen.findByRole('menuitem', { name: 'Remove from this list' }))
  expect(server.changes).toEqual([{ route: 'POST /api/workers/remove', body: { worker: 'old@box/1' } }])
})

test('viewers look on', async () => {
  startServer({ ...routes, 'GET /api/account': { ...account, administrates: false, may_launch: false } })
  open('/queue')
  await screen.findAllByTestId('waiting-run')
  expect(screen.queryByRole('textbox')).toBeNull()
  expect(screen.queryByRole('button', { name: /Actions for/ })).toBeNull()
  expect(screen.queryByTestId('jobs')).toBeNull()
})

test('an empty queue and a failed one say so', async () => {
  startServer({
    ...routes,
    'GET /api/queue': { items: [], total: 0, hidden: 0, jobs: 0 },
    'GET /api/workers': refusal(400, 'Not today.'),
  })
  open('/queue')
  expect(await screen.findByText(/^Nothing waits/)).toBeInTheDocument()
  expect(await screen.findByText('Not today.')).toBeInTheDocument()
})
