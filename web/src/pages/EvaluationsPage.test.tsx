import { screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import type { AskedEvaluation, Leaderboard, Outcome } from '../api/types'
import { experiment, field, form, policy, listed as trained, training } from '../testing/examples'
import { open } from '../testing/render'
import { FakeEventSource, refusal, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const success = {
  value: 0.75,
  low: 0.68,
  high: 0.81,
  unit: 'episodes' as const,
  seeds: 1,
  episodes: 200,
  per_seed: [0.75],
  failed: null,
}

const measured: AskedEvaluation = {
  id: 'ev1',
  title: 'dynamic window',
  policy: { source: 'baseline', name: 'dynamic window', task: null },
  choice: { by: 'name', name: 'complex-200' },
  run_id: null,
  waits_for: [],
  created_at: 0,
  job_id: 'job1',
  behind: [],
  starts_in: null,
  state: 'done',
  progress: 1,
  seconds_left: null,
  error: null,
  suite: 'complex-200',
  suite_hash: 'abc',
  figures: {
    episodes: 200,
    success,
    collision: 0.2,
    timeout: 0.05,
    spl: 0.7,
    worst_tenth_spl: 0,
    steps: 90,
    seconds: 18,
    path_length: 4.4,
    min_clearance: 0.21,
    jerk: 0.3,
    reward: 12,
    terms: [
      { name: 'arrival', value: 90 },
      { name: 'collision', value: -78 },
    ],
  },
}
const running: AskedEvaluation = {
  ...measured,
  id: 'ev2',
  state: 'running',
  progress: 0.4,
  seconds_left: 6,
  suite: null,
  suite_hash: null,
  figures: null,
}
const routes = {
  'GET /api/evaluations': { items: [running, measured], total: 2 },
  'GET /api/policies': [policy],
  'GET /api/leaderboards': {
    suites: [{ suite: 'complex-200', suite_hash: 'abc', entries: 3, frozen: true }],
  },
  'GET /api/arenas': [],
  'GET /api/suites': [],
  'GET /api/uploads': { items: [], total: 0 },
  'GET /api/projects': {
    items: [{ id: 'default', name: 'Default', role: 'admin', experiments: 0 }],
    total: 1,
  },
  'GET /api/experiments': { items: [], total: 0 },
  'POST /api/evaluations': [running],
}

test('what is under way says how long it takes, what is measured its figures', async () => {
  const server = startServer({
    ...routes,
    'POST /api/evaluations/ev2/cancel': { ...running, state: 'cancelled' },
  })
  const { user } = open('/evaluations')
  const [open_, done] = await screen.findAllByTestId('evaluation')
  expect(open_).toHaveTextContent('6 s left')
  expect(within(open_ as HTMLElement).getByRole('progressbar')).toHaveAttribute('aria-valuenow', '40')
  expect(done).toHaveTextContent(/Dynamic window\s*complex-200\s*75\.0\s%/)
  expect(done).toHaveTextContent(/20\.0\s%\s*0\.70\s*18\ss\s*0\.21\sm/)
  await user.click(screen.getByRole('button', { name: 'Call it off: Dynamic window' }))
  await waitFor(() => expect(server.changes[0]?.route).toBe('POST /api/evaluations/ev2/cancel'))
})

test('what waits says behind what, and about how long', async () => {
  const waits = { ...running, state: 'queued' as const, progress: 0, seconds_left: null }
  const behind = ['MPPI on maze 1', 'VFH+ on maze 1']
  startServer({
    ...routes,
    'GET /api/evaluations': {
      items: [
        { ...waits, behind: behind.slice(0, 1), starts_in: 300 },
        { ...waits, id: 'ev3', behind },
        { ...waits, id: 'ev4' },
      ],
      total: 3,
    },
  })
  open('/evaluations')
  const [first, second, third] = await screen.findAllByTestId('evaluation')
  expect(first).toHaveTextContent(/Waits behind MPPI on maze 1, about 5\smin/)
  expect(second).toHaveTextContent('Waits behind MPPI on maze 1 and 1 more')
  expect(third).toHaveTextContent('Waits for a worker')
})

test('policies on suites are chosen, or come with the address', async () => {
  const now = { suite: 'complex-200', suite_hash: 'abc', entries: 3, frozen: true }
  // What was measured before the suite changed has a board of its own.
  const server = startServer({
    ...routes,
    'GET /api/leaderboards': { suites: [now, { ...now, suite_hash: 'before' }] },
  })
  const arena = JSON.stringify({ name: 'maze', difficulty: 0.8 })
  const { user } = open(
    `/evaluations?policy=shipped:crowd&policy=nonsense&suite=${encodeURIComponent(`arena:${arena}`)}`,
  )
  await waitFor(() => expect(screen.getAllByText('Crowd').length).toBeGreaterThan(0))
  expect(screen.getByRole('slider', { name: 'Difficulty of families' })).toHaveAttribute(
    'aria-valuenow',
    '0.8',
  )
  await user.click(screen.getByRole('combobox', { name: 'Policies' }))
  await user.click(await screen.findByRole('option', { name: 'Dynamic window' }))
  await user.click(screen.getByRole('combobox', { name: 'On' }))
  await user.click(await screen.findByRole('option', { name: 'complex-200' }))
  await user.click(screen.getByRole('button', { name: 'Evaluate, 4 times' }))
  await waitFor(() => expect(server.changes).toHaveLength(1))
  expect(server.changes[0]?.body).toEqual({
    policies: [
      { source: 'shipped', name: 'crowd' },
      { source: 'baseline', name: 'dynamic window', task: null },
    ],
    suites: [
      { by: 'arena', arena: { name: 'maze', difficulty: 0.8 } },
      { by: 'name', name: 'complex-200' },
    ],
  })
})

test('suites of one’s own are listed, chosen and deleted', async () => {
  const suite = {
    id: 'su1',
    name: 'My lab',
    created_at: 1,
    scenarios: [
      { sha256: 'a'.repeat(64), name: 'A chair' },
      { sha256: 'b'.repeat(64), name: 'A crowd' },
    ],
  }
  const none = { ...suite, id: 'su2', name: 'Begun', scenarios: [] }
  const server = startServer({
    ...routes,
    'GET /api/suites': [none, suite],
    'DELETE /api/suites/su2': new Response(null, { status: 204 }),
  })
  const { user } = open('/evaluations?policy=shipped:crowd')
  const [begun, whole] = await screen.findAllByTestId('own-suite')
  expect(begun).toHaveTextContent(/Begun\s*none yet/)
  expect(whole).toHaveTextContent(/My lab\s*2 scenarios: A chair, A crowd/)
  await user.click(screen.getByRole('combobox', { name: 'On' }))
  await user.click(await screen.findByRole('option', { name: 'My lab' }))
  await user.click(screen.getByRole('button', { name: 'Evaluate, 1 time' }))
  await waitFor(() => expect(server.changes).toHaveLength(1))
  expect(server.changes[0]?.body).toMatchObject({ suites: [{ by: 'scenarios', id: 'su1' }] })
  await user.click(screen.getByRole('button', { name: 'Delete Begun' }))
  const question = await screen.findByRole('dialog', { name: 'Delete “Begun”?' })
  expect(server.changes).toHaveLength(1)
  await user.click(within(question).getByRole('button', { name: 'Delete' }))
  await waitFor(() => expect(server.changes.at(-1)?.route).toBe('DELETE /api/suites/su2'))
})

test('an evaluation shows its figures and its ways, and a click on one replays it', async () => {
  const place = { arena: 0, name: 'room', episodes: 2, arrivals: 1 }
  startServer({
    ...routes,
    'GET /api/evaluations/ev1': measured,
    'GET /api/evaluations/ev1/episodes': { suite: 'complex-200', suite_hash: 'abc', episodes: [] },
    'GET /api/evaluations/ev1/ways': {
      places: [place],
      arena: 0,
      geometry: {
        format: 'mapless-arena/1',
        name: 'room',
        width: 6,
        height: 6,
        circles: [],
        boxes: [],
        movers: [],
        start: null,
        target: null,
      },
      ways: [
        {
          episode: 0,
          outcome: 'arrival',
          target: [1, 1],
          points: [
            [0, 0],
            [1, 1],
          ],
        },
        {
          episode: 1,
          outcome: 'collision',
          target: [2, 2],
          points: [
            [0, 0],
            [-2.9, 0],
          ],
        },
      ],
    },
  })
  const { user } = open('/evaluations/ev1')
  expect(await screen.findByRole('img', { name: '2 ways in room, from above' })).toBeInTheDocument()
  expect(screen.getByText('SPL of the worst tenth').parentElement).toHaveTextContent('0.000')
  await user.click(screen.getByText('Collisions 1'))
  expect(screen.getByRole('img', { name: '1 ways in room, from above' })).toBeInTheDocument()
  await user.click(screen.getByRole('switch', { name: 'Where it collides' }))
  expect(screen.getByRole('link', { name: 'Leaderboard' })).toHaveAttribute('href', '/leaderboards/abc')
})

const episode = (outcome: Outcome, steps: number, clearance: number) => ({
  outcome,
  steps,
  reward: 1,
  path_length: 4,
  shortest_path: 3,
  min_clearance: clearance,
})
/** Three episodes on two maps. */
const listed = {
  suite: 'complex-200',
  suite_hash: 'abc',
  episodes: [episode('arrival', 90, 0.3), episode('collision', 12, 0), episode('arrival', 60, 0.1)],
  maps: ['maze-1', 'maze-2', 'maze-2'],
  spl: [0.6, 0, 0.9],
}
const rows = () => screen.getAllByTestId('episode').map((row) => row.textContent?.match(/^\d+/)?.[0])

test('episodes are put in order by a head’s press, the worst first, and the order stands in the address', async () => {
  startServer({
    ...routes,
    'GET /api/evaluations/ev1': measured,
    'GET /api/evaluations/ev1/episodes': listed,
    'GET /api/evaluations/ev1/ways': refusal(404, 'Not kept.'),
  })
  const { user, router } = open('/evaluations/ev1')
  await screen.findAllByTestId('episode')
  expect(rows()).toEqual(['2', '3', '1'])
  expect(screen.getAllByTestId('episode')[0]).toHaveTextContent('maze-2')
  const head = (name: string) => screen.getByRole('columnheader', { name: new RegExp(`^${name}`) })
  await user.click(within(head('Steps')).getByRole('button'))
  expect(rows()).toEqual(['1', '3', '2'])
  expect(head('Steps')).toHaveAttribute('aria-sort', 'ascending')
  expect(router.state.location.search).toBe('?order=steps')
  await user.click(within(head('Steps')).getByRole('button'))
  expect(rows()).toEqual(['2', '3', '1'])
  expect(router.state.location.search).toBe('?order=-steps')
  await user.click(within(head('Steps')).getByRole('button'))
  expect(router.state.location.search).toBe('')
  await user.click(within(head('SPL')).getByRole('button'))
  expect(rows()).toEqual(['2', '1', '3'])
})

test('a number opens the episodes behind it', async () => {
  startServer({
    ...routes,
    'GET /api/evaluations/ev1': measured,
    'GET /api/evaluations/ev1/episodes': listed,
    'GET /api/evaluations/ev1/ways': refusal(404, 'Not kept.'),
  })
  const { user, router } = open('/evaluations')
  const [, done] = await screen.findAllByTestId('evaluation')
  await user.click(within(done as HTMLElement).getByRole('link', { name: /^20\.0/ }))
  expect(router.state.location).toMatchObject({ pathname: '/evaluations/ev1', search: '?outcome=collision' })
  await screen.findAllByTestId('episode')
  expect(rows()).toEqual(['2'])
  await user.click(screen.getByRole('link', { name: /^75\.0/ }))
  expect(rows()).toEqual(['3', '1'])
  expect(router.state.location.search).toBe('?outcome=arrival')
})

test('the return is told by the reward’s terms, and everything can be taken away', async () => {
  const server = startServer({
    ...routes,
    'GET /api/evaluations/ev1': measured,
    'GET /api/evaluations/ev1/episodes': listed,
    'GET /api/evaluations/ev1/ways': refusal(404, 'Not kept.'),
  })
  const { user, unmount } = open('/evaluations/ev1')
  expect(await screen.findByLabelText('Return by reward terms')).toHaveTextContent('Arrival90Collision−78')
  await user.click(screen.getByRole('button', { name: 'Export' }))
  const items = (await screen.findAllByRole('menuitem')).map((item) => item.getAttribute('href'))
  expect(items).toEqual(
    ['csv', 'json', 'latex', 'markdown'].map((format) => `/api/evaluations/ev1/export?format=${format}`),
  )
  unmount()
  const before = { ...measured, figures: { ...(measured.figures as object), terms: null } }
  server.routes['GET /api/evaluations/ev1'] = before
  open('/evaluations/ev1')
  expect(
    await screen.findByText('The return by reward terms was not kept when this was measured.'),
  ).toBeInTheDocument()
})

test('an evaluation is deleted after a question', async () => {
  const server = startServer({
    ...routes,
    'DELETE /api/evaluations/ev1': new Response(null, { status: 204 }),
  })
  const { user } = open('/evaluations')
  await user.click(await screen.findByRole('button', { name: 'Delete: Dynamic window' }))
  const question = await screen.findByRole('dialog', { name: 'Delete “Dynamic window” on complex-200?' })
  expect(server.changes).toHaveLength(0)
  await user.click(within(question).getByRole('button', { name: 'Delete' }))
  await waitFor(() => expect(server.changes[0]?.route).toBe('DELETE /api/evaluations/ev1'))
})

test('an ONNX file is uploaded with what it is for: filled in as of a training, changed, and compared by the server', async () => {
  const shapes = {
    observation: 16,
    parts: [
      { name: 'ranges', numbers: 10 },
      { name: 'bearing', numbers: 6 },
    ],
    actions: [{ name: 'linear', low: -0.125, high: 0.25, unit: 'm/s' }],
  }
  const own = { ...training.task, observation: 'paper' }
  const said = 'The policy can not be used: it is (n, 15).'
  const server = startServer({
    ...routes,
    'GET /api/training/form': form,
    'GET /api/experiments': { items: [trained], total: 1 },
    'GET /api/experiments/exp1': { ...experiment, training: { ...training, task: own } },
    'POST /api/uploads/shapes': shapes,
    'POST /api/uploads': refusal(422, [{ loc: ['body', 'content'], msg: said, type: 'refused' }]),
  })
  const { user } = open('/evaluations')
  await screen.findByRole('button', { name: 'Upload a policy' })
  const input = document.querySelector<HTMLInputElement>('input[accept=".onnx,.zip"]') as HTMLInputElement
  await user.upload(input, new File(['a graph'], 'mine.onnx'))
  const dialog = within(await screen.findByRole('dialog', { name: 'Upload mine.onnx' }))
  expect(await dialog.findByTestId('shapes')).toHaveTextContent(
    'takes “observation” (n, 16): ranges 10, bearing 6; and gives “action” (n, 1) in fractions of linear −0.125 to 0.25 m/s',
  )
  expect(dialog.getByRole('radio', { name: 'Improved' })).toBeChecked()
  // What is paid, and where it drives, is not the policy's.
  expect(dialog.queryByText('Arena')).toBeNull()
  expect(dialog.queryByText('Terms')).toBeNull()
  await user.click(dialog.getByRole('combobox', { name: 'As of' }))
  await user.click(await screen.findByRole('option', { name: 'Corridor' }))
  await waitFor(() => expect(dialog.getByRole('radio', { name: 'Paper' })).toBeChecked())
  await user.click(dialog.getByRole('radio', { name: 'Improved' }))
  await user.click(dialog.getByRole('button', { name: 'Upload' }))
  expect(await dialog.findByRole('alert')).toHaveTextContent(said)
  const sent = server.changes.find(({ route }) => route === 'POST /api/uploads')?.body
  expect(sent).toMatchObject({ name: 'mine', task: { ...own, observation: 'improved' } })
})

test('what does not fit in a task is said at its field before anything is uploaded', async () => {
  const loc = ['body', 'task', 'observation']
  startServer({
    ...routes,
    'GET /api/training/form': form,
    'POST /api/uploads/shapes': refusal(422, [
      { loc, msg: 'batches must divide the rays', type: 'value_error' },
    ]),
  })
  const { user } = open('/evaluations')
  await screen.findByRole('button', { name: 'Upload a policy' })
  const input = document.querySelector<HTMLInputElement>('input[accept=".onnx,.zip"]') as HTMLInputElement
  await user.upload(input, new File(['a graph'], 'mine.onnx'))
  expect(await screen.findByText('Batches must divide the rays')).toBeVisible()
})

test('an uploaded policy is deleted after a question', async () => {
  const mine = {
    id: 'up1',
    name: 'Mine',
    project_id: 'default',
    task: {},
    sha256: 'a',
    size: 2048,
    created_at: 1,
  }
  const server = startServer({
    ...routes,
    'GET /api/uploads': { items: [mine], total: 1 },
    'DELETE /api/uploads/up1': new Response(null, { status: 204 }),
  })
  const { user } = open('/evaluations')
  expect(await screen.findByTestId('uploaded-policy')).toHaveTextContent(/^Mine2/)
  await user.click(screen.getByRole('button', { name: 'Delete Mine' }))
  const question = await screen.findByRole('dialog', { name: 'Delete “Mine”?' })
  expect(server.changes).toHaveLength(0)
  await user.click(within(question).getByRole('button', { name: 'Delete' }))
  await waitFor(() => expect(server.changes[0]?.route).toBe('DELETE /api/uploads/up1'))
})

test('why something can’t be measured stands in the form', async () => {
  startServer({
    ...routes,
    'POST /api/evaluations': refusal(400, 'Mine: suite ‘barn’ is for the robot Jackal-like.'),
  })
  const { user } = open('/evaluations?policy=shipped:crowd')
  await user.click(await screen.findByRole('button', { name: 'Evaluate, 1 time' }))
  expect(await screen.findByRole('alert')).toHaveTextContent('is for the robot Jackal-like')
})

test('a checkpoint that comes with the address is named by training, seed and step', async () => {
  startServer({
    ...routes,
    'GET /api/checkpoints/nkny4x/start': {
      start_from: { source: 'checkpoint', name: 'nkny4x', sha256: null, title: 'Rooms, seed 1, step 40 000' },
      kind: 'best',
      experiment_id: 'e1',
      success: null,
    },
  })
  open('/evaluations?policy=checkpoint:nkny4x')
  await waitFor(() => expect(screen.getAllByText('Rooms, seed 1, step 40 000').length).toBeGreaterThan(0))
})

test('a leaderboard says what is tied with the best, and by what that is known', async () => {
  const of = { experiment_id: null, evaluations: [], p: null }
  const entry = { ...of, kind: 'shipped' as const, spl: 0.9, steps: 80, success }
  const board: Leaderboard = {
    suite: 'complex-200',
    suite_hash: 'abc',
    meaning: "The paper's complex arena.",
    comparisons: 2,
    entries: [
      { ...entry, rank: 1, id: 'crowd', title: 'Crowd', tied: true, told_by: 'best' },
      {
        ...entry,
        rank: 2,
        kind: 'training',
        id: 'e1',
        experiment_id: 'e1',
        evaluations: [],
        p: 0.2,
        title: 'Mine',
        tied: true,
        told_by: 'seeds',
      },
      {
        ...entry,
        rank: 3,
        kind: 'baseline',
        id: 'random',
        title: 'random',
        tied: false,
        told_by: 'episodes',
      },
    ],
  }
  startServer({ ...routes, 'GET /api/leaderboards/abc': board })
  open('/leaderboards')
  const rows = await screen.findAllByTestId('entry')
  expect(rows.map((row) => row.textContent)).toEqual([
    expect.stringMatching(/^1CrowdShipped.*Best/),
    expect.stringMatching(/^2MineTraining.*Tied/),
    expect.stringMatching(/^3RandomUntrained.*Below/),
  ])
  expect(screen.getByText("The paper's complex arena.")).toBeInTheDocument()
  expect(screen.getByRole('link', { name: 'Mine' })).toHaveAttribute('href', '/experiments/e1')
  expect(
    screen.getByText(/2 entries can't be told from the best, itself included\. 2 tests/),
  ).toBeInTheDocument()
})

test('what was asked for is called by what it is, and the seeds of a training are one entry', async () => {
  const entry = { spl: 0.9, steps: 80, success, tied: true, told_by: 'nothing' as const, p: null }
  const seeds = {
    ...success,
    unit: 'seeds' as const,
    seeds: 2,
    per_seed: [0.7, 0.8],
    failed: { failed: 0, seeds: 2, at_most: 0.78, told: true, sentence: 'None of 2 seeds failed.' },
  }
  startServer({
    ...routes,
    'GET /api/leaderboards/abc': {
      suite: 'complex-200',
      suite_hash: 'abc',
      meaning: null,
      comparisons: 0,
      entries: [
        {
          ...entry,
          rank: 1,
          kind: 'baseline',
          id: 'ev1',
          evaluations: ['ev1'],
          title: 'VFH+',
          told_by: 'best',
        },
        {
          ...entry,
          rank: 2,
          kind: 'evaluation',
          id: 'ev2',
          experiment_id: 'e1',
          evaluations: ['ev2', 'ev3'],
          title: 'base',
          success: seeds,
        },
        {
          ...entry,
          rank: 3,
          kind: 'evaluation',
          id: 'ev4',
          experiment_id: 'e2',
          evaluations: ['ev4'],
          title: 'other, seed 0, step 5',
        },
        { ...entry, rank: 4, kind: 'uploaded', id: 'ev5', evaluations: ['ev5'], title: 'From elsewhere' },
      ],
    },
  })
  open('/leaderboards/abc')
  const rows = await screen.findAllByTestId('entry')
  expect(rows[0]).toHaveTextContent(/^1VFH\+Untrained.*N = 200/)
  expect(rows[0]).not.toHaveTextContent('one seed')
  expect(rows[1]).toHaveTextContent(/^2baseEvaluation.*N = 2 seeds, none failed.*Not told/)
  expect(rows[3]).toHaveTextContent(/^4From elsewhereUploaded/)
  // A number opens its episodes where one evaluation stands behind it; of several seeds the training has them.
  const links = (row: HTMLElement) =>
    within(row)
      .getAllByRole('link')
      .map((link) => link.getAttribute('href'))
  expect(rows.map(links)).toEqual([
    ['/evaluations/ev1', '/evaluations/ev1?outcome=arrival'],
    ['/experiments/e1'],
    ['/evaluations/ev4', '/evaluations/ev4?outcome=arrival'],
    ['/evaluations/ev5', '/evaluations/ev5?outcome=arrival'],
  ])
})

test('an ONNX file is uploaded for the robot of a policy, and chosen at once; a refusal stands in the dialog', async () => {
  const server = startServer({
    ...routes,
    'GET /api/training/form': form,
    'POST /api/uploads/shapes': { observation: 16, parts: [], actions: [] },
    'POST /api/uploads': refusal(422, [{ loc: ['body', 'content'], msg: 'The file is empty.' }]),
  })
  const { user } = open('/evaluations')
  await screen.findByRole('button', { name: 'Upload a policy' })
  const input = document.querySelector('input[type=file]') as HTMLInputElement
  await user.upload(input, new File(['abc'], 'mine.onnx'))
  const dialog = await screen.findByRole('dialog', { name: 'Upload mine.onnx' })
  expect(await within(dialog).findByRole('textbox', { name: 'Name' })).toHaveValue('mine')
  await user.click(within(dialog).getByRole('combobox', { name: 'As of' }))
  await user.click(await screen.findByRole('option', { name: 'Crowd' }))
  await user.click(within(dialog).getByRole('button', { name: 'Upload' }))
  expect(await within(dialog).findByText('The file is empty.')).toBeInTheDocument()
  server.routes['POST /api/uploads'] = { id: 'up1', name: 'mine' }
  await user.click(within(dialog).getByRole('button', { name: 'Upload' }))
  await waitFor(() => expect(screen.queryByRole('dialog')).not.toBeInTheDocument())
  expect(server.changes.at(-1)?.body).toEqual({
    name: 'mine',
    project_id: 'default',
    content: btoa('abc'),
    task: policy.training.task,
  })
  expect(await screen.findByRole('button', { name: 'Evaluate, 1 time' })).toBeEnabled()
})

test('families lead to their matrix, below the policies', async () => {
  startServer({ ...routes, 'GET /api/field': field, 'GET /api/training/form': form })
  // What is scrolled to before the policies have come is pushed out of sight by them.
  const scrolled: [string, number][] = []
  vi.spyOn(Element.prototype, 'scrollIntoView').mockImplementation(function (this: Element) {
    scrolled.push([this.id, screen.queryAllByTestId('policy').length])
  })
  const { router, user } = open('/evaluations')
  const link = await screen.findByRole('link', { name: 'Families' })
  expect(link).toHaveAttribute('href', '/policies#families')
  await user.click(link)
  expect(router.state.location).toMatchObject({ pathname: '/policies', hash: '#families' })
  await screen.findByTestId('policy')
  await waitFor(() => expect(scrolled).toEqual([['families', 1]]))
  expect(await screen.findByRole('heading', { name: 'Where they have never been' })).toBeInTheDocument()
})
