import { screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import {
  checkpoints,
  episodeSeries,
  episodes,
  experiment,
  live,
  NOW,
  noCheckpoints,
  replay,
  runDetail,
  status,
} from '../testing/examples'
import { open } from '../testing/render'
import { FakeEventSource, refusal, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const routes = {
  'GET /api/runs/run1': runDetail,
  'GET /api/runs/run1/metrics': {
    series: [{ name: 'train/success_rate', steps: [4096, 8192], values: [0.1, 0.4], min: null, max: null }],
    attempt: 1,
    since: null,
  },
  'GET /api/runs/run1/checkpoints': checkpoints,
  'GET /api/runs/run1/log': {
    total: 3,
    lines: [
      { at: NOW - 50, kind: 'event', attempt: null, step: 0, level: 'info', text: 'Claimed by worker-1' },
      {
        at: NOW - 30,
        kind: 'output',
        attempt: 1,
        step: null,
        level: 'info',
        text: 'UserWarning: old driver',
      },
      {
        at: NOW - 10,
        kind: 'event',
        attempt: null,
        step: 90_000,
        level: 'warning',
        text: 'Link lost for 2 s',
      },
    ],
  },
  'GET /api/runs/run1/live': live,
  'GET /api/checkpoints/cp2/episodes': episodes,
  'GET /api/experiments/exp1': experiment,
}

const way = {
  items: [
    { id: 'cp1', step: 50_000, success: null },
    { id: 'cp2', step: 100_000, success: 0.885 },
  ],
  total: 2,
}

test('curves and checkpoints are asked for beside the run, once, and not when it has come', async () => {
  let answer: (run: object) => void = () => undefined
  const server = startServer({
    ...routes,
    'GET /api/runs/run1': () => new Promise((come) => (answer = come)),
  })
  open('/runs/run1')
  const first = ['/api/runs/run1/metrics?points=600', '/api/runs/run1/checkpoints?limit=25&offset=0']
  await waitFor(() => expect(server.asked).toEqual(expect.arrayContaining(['/api/runs/run1', ...first])))
  answer({ ...runDetail, state: 'completed' }) // one that goes on is asked again after a while
  await screen.findByRole('heading', { level: 1, name: /seed/ })
  await waitFor(() => expect(server.asked).toContain('/api/runs/run1/lineage'))
  // Until what stands lowest is asked for; on a slow machine all may be asked again later, as it is after a while.
  const asked = server.asked.slice(0, server.asked.indexOf('/api/runs/run1/lineage'))
  expect(asked.filter((path) => first.includes(path))).toEqual(first)
})

test('any checkpoint is watched: from its row, by the slider, by a link', async () => {
  startServer({
    ...routes,
    'GET /api/runs/run1/checkpoints/steps': way,
    'GET /api/checkpoints/cp1/live': live,
    'GET /api/checkpoints/cp2/live': live,
  })
  const { user, router } = open('/runs/run1')
  await user.click(await screen.findByRole('button', { name: 'Watch step 50000' }))
  expect(await screen.findByTitle('The robots in 3D')).toHaveAttribute('src', '/live/checkpoint-cp1/')
  expect(router.state.location.search).toBe('?watch=50000')
  expect(await screen.findByText(/The policy of step 50\s000/)).toBeInTheDocument()
  const slider = screen.getByRole('slider', { name: 'Watch it at a checkpoint' })
  slider.focus()
  await user.keyboard('{ArrowRight}')
  expect(screen.getByTestId('learning')).toHaveTextContent(/Step 100\s000, 88\.5\s% arrive/)
  await waitFor(() =>
    expect(screen.getByTitle('The robots in 3D')).toHaveAttribute('src', '/live/checkpoint-cp2/'),
  )
  slider.focus()
  await user.keyboard('{ArrowRight}')
  await waitFor(() => expect(screen.getByTitle('The robots in 3D')).toHaveAttribute('src', '/live/run1/'))
  expect(router.state.location.search).toBe('')
})

test('a time lapse says which checkpoint drives, and how far it is while it is made', async () => {
  startServer({
    ...routes,
    'GET /api/runs/run1/checkpoints/steps': way,
    'GET /api/runs/run1/lapse': () => new Promise<object>(() => {}),
    'GET /api/runs/run1/lapse/progress': { ready: 1, policies: 2, share: 0.6 },
  })
  const { user } = open('/runs/run1')
  await user.click(await screen.findByRole('button', { name: 'Time lapse' }))
  const dialog = await screen.findByRole('dialog', { name: 'Time lapse' })
  expect(await within(dialog).findByText('Driving 2 evaluations once more: 1 are there.')).toBeInTheDocument()
  await user.keyboard('{Escape}')
  await waitFor(() => expect(screen.queryByRole('dialog')).not.toBeInTheDocument())
})

test('a link to a time lapse opens it', async () => {
  startServer({
    ...routes,
    'GET /api/runs/run1/checkpoints/steps': way,
    'GET /api/runs/run1/lapse': {
      suite: 'simple-200',
      scenarios: 8,
      page: '/replays/lapses/run1/',
      chapters: [
        { step: 50_000, success: 0.1, begins: 0 },
        { step: 100_000, success: 0.885, begins: 7.5 },
      ],
    },
  })
  open('/runs/run1?lapse=1')
  expect(await screen.findByTitle("The run's learning in 3D")).toHaveAttribute(
    'src',
    '/replays/lapses/run1/light/',
  )
  expect(screen.getByRole('button', { name: /50\s000: 10\.0\s%/ })).toBeInTheDocument()
  // Two pictures at once would share one machine.
  expect(screen.queryByTitle('The robots in 3D')).not.toBeInTheDocument()
})

test("the run's own data are exported on its page", async () => {
  startServer(routes)
  const { user } = open('/runs/run1')
  await user.click(await screen.findByRole('button', { name: 'Actions for Corridor' }))
  const item = await screen.findByRole('menuitem', { name: 'Curves, CSV' })
  expect(item).toHaveAttribute('href', '/api/runs/run1/export?format=csv')
})

test('a running run: how far it is, its curves, its robots', async () => {
  startServer(routes)
  open('/runs/run1')
  const vitals = await screen.findByTestId('vitals')
  expect(vitals).toHaveTextContent('Running')
  expect(vitals).toHaveTextContent(/120\s000 of 300\s000/)
  expect(vitals).toHaveTextContent('13 s')
  expect(within(vitals).getByRole('progressbar')).toHaveAttribute('aria-valuenow', '40')
  expect(document.title).toBe('Corridor, seed 0 – Mapless')
  expect(await screen.findByRole('figure', { name: 'Success rate' })).toHaveTextContent(/training\s*40\.0\s%/)
  expect(screen.getByTitle('The robots in 3D')).toHaveAttribute('src', '/live/run1/')
  await waitFor(() => expect(screen.queryByTestId('live-overlay')).not.toBeInTheDocument())
})

test('of a run that goes on only new points are asked for', async () => {
  const server = startServer(routes)
  open('/runs/run1')
  const chart = await screen.findByRole('figure', { name: 'Success rate' })
  expect(chart).toHaveTextContent(/training\s*40\.0\s%/)
  await waitFor(() => expect(FakeEventSource.open).toHaveLength(1))
  server.routes['GET /api/runs/run1/metrics'] = (request: Request) => {
    expect(new URL(request.url).search).toBe('?points=600&since=8192&attempt=1')
    const news = {
      name: 'train/success_rate',
      steps: [8192, 12_288],
      values: [0.4, 0.7],
      min: null,
      max: null,
    }
    return { series: [news], attempt: 1, since: 8192 }
  }
  FakeEventSource.open[0]?.send({ experiment_id: 'exp1', run_id: 'run1', kind: 'metrics' })
  await waitFor(() => expect(chart).toHaveTextContent(/training\s*70\.0\s%/), { timeout: 4_000 })
})

test('a completed run went to the end of its last rollout: so many steps, of no number', async () => {
  startServer({ ...routes, 'GET /api/runs/run1': { ...runDetail, state: 'completed', step: 303_104 } })
  open('/runs/run1')
  expect(await screen.findByTestId('vitals')).toHaveTextContent(/Steps303\s104(?! of)/)
})

test('settings that another version stored are named', async () => {
  startServer({ ...routes, 'GET /api/runs/run1': { ...runDetail, unreadable: ['algorithm.magic'] } })
  open('/runs/run1')
  expect(await screen.findByTestId('unreadable')).toHaveTextContent('algorithm.magic')
})

test('what a run waits for, and what a training was made with that is not here', async () => {
  const my_lab = { name: 'my_lab', version: '1.2', source: 'pip install my_lab==1.2' }
  const queued = { ...runDetail, state: 'queued' as const, waits_for: [my_lab] }
  startServer({ ...routes, 'GET /api/runs/run1': queued })
  open('/runs/run1')
  expect(await screen.findByTestId('waits-for')).toHaveTextContent(
    /Waits for a worker with my_lab\s1\.2.*pip install my_lab==1\.2/,
  )
})

test('a training whose extension is not here says which, and how to get it', async () => {
  const my_lab = { name: 'my_lab', version: '1.2', source: 'pip install my_lab==1.2' }
  startServer({
    ...routes,
    'GET /api/runs/run1': { ...runDetail, unreadable: ['algorithm'], lacking: [my_lab] },
  })
  open('/runs/run1')
  expect(await screen.findByTestId('unreadable')).toHaveTextContent(
    /Made with my_lab\s1\.2, which is not here.*pip install my_lab==1\.2.*algorithm/,
  )
})

test('its policies, the newest first, the best marked, each to take away', async () => {
  startServer(routes)
  open('/runs/run1')
  const rows = await screen.findAllByTestId('checkpoint')
  const links = rows.map((row) => within(row).getAllByRole('link'))
  expect(links.map((row) => row.map((link) => link.getAttribute('href')))).toEqual([
    [
      '/new?checkpoint=cp2',
      '/playground?policy=checkpoint%3Acp2',
      '/evaluations?policy=checkpoint%3Acp2',
      '/api/checkpoints/cp2/bundle',
      '/api/checkpoints/cp2/download',
    ],
    [
      '/new?checkpoint=cp1',
      '/playground?policy=checkpoint%3Acp1',
      '/evaluations?policy=checkpoint%3Acp1',
      '/api/checkpoints/cp1/bundle',
      '/api/checkpoints/cp1/download',
    ],
  ])
  expect(rows[0]).toHaveTextContent('Best')
  expect(rows[0]).toHaveTextContent(/88\.5\s%\s*83\.3–92\.2\s%\s*N = 200/)
  expect(rows[1]).not.toHaveTextContent('Best')
})

test('two thousand policies come a page at a time, and the one in the address from whichever page', async () => {
  const pageAt = (offset: number) => ({
    items: Array.from({ length: 25 }, (_, index) => ({
      ...checkpoints.items[0],
      id: `cp${offset + index}`,
      step: 2_000_000 - 1_000 * (offset + index),
      best: false,
    })),
    total: 2_000,
    best: checkpoints.best,
  })
  const server = startServer({
    ...routes,
    'GET /api/runs/run1/checkpoints': (request: Request) => {
      const query = new URL(request.url).searchParams
      return query.has('step')
        ? { ...pageAt(1_500), items: pageAt(1_500).items.slice(0, 1), total: 1 }
        : pageAt(Number(query.get('offset')))
    },
    'GET /api/checkpoints/cp1500/episodes': episodes,
  })
  const { user } = open('/runs/run1?step=500000')
  expect(await screen.findAllByTestId('checkpoint')).toHaveLength(25)
  expect(await screen.findByText(/Episodes of step 500\s000/)).toBeInTheDocument()
  expect(screen.getByText(/1–25 of 2\s000/)).toBeInTheDocument()
  await user.click(screen.getByRole('button', { name: 'Next page' }))
  expect(await screen.findByText(/26–50 of 2\s000/)).toBeInTheDocument()
  await waitFor(() => expect(server.asked.some((path) => path.includes('offset=25'))).toBe(true))
  // The best of all stands above each page.
  await waitFor(() => expect(screen.getAllByTestId('checkpoint')[1]).toHaveTextContent(/1\s975\s000/))
  expect(screen.getAllByTestId('checkpoint')[0]).toHaveTextContent('Best')
})

test('the episodes behind its best policy, failures first, by outcome', async () => {
  startServer(routes)
  const { user } = open('/runs/run1')
  const list = await screen.findByTestId('episodes')
  expect(screen.getByRole('heading', { name: /Episodes of step 100\s000 on simple-200/ })).toBeInTheDocument()
  const shown = () => within(list).getAllByTestId('episode')
  // Within an outcome, the smallest clearance comes first.
  expect(shown().map((row) => within(row).getAllByRole('cell')[0]?.textContent)).toEqual([
    '2',
    '5',
    '3',
    '4',
    '1',
  ])
  expect(shown()[4]).toHaveTextContent(/Arrival\s*90\s*4\.4 m\s*1\.10 ×\s*0\.50 m/)
  // How far it would have been says nothing about an attempt that failed.
  expect(shown()[0]).toHaveTextContent(/Collision\s*12\s*0\.6 m\s*–/)
  await user.click(within(list).getByRole('radio', { name: 'Collisions 2' }))
  expect(shown().map((row) => row.dataset.outcome)).toEqual(['collision', 'collision'])
})

test('an episode is replayed; its address can be passed on', async () => {
  startServer({
    ...routes,
    'GET /api/replays/checkpoint%3Acp2/1': replay,
    'GET /api/replays/checkpoint%3Acp2/1/series': episodeSeries,
  })
  const { user, router } = open('/runs/run1')
  await user.click(await screen.findByRole('button', { name: 'Replay episode 2' }))
  expect(await screen.findByTitle('The episode in 3D')).toHaveAttribute(
    'src',
    '/replays/checkpoint:cp2/1/light/',
  )
  expect(router.state.location.search).toBe('?replay=2')
  const dialog = screen.getByRole('dialog', { name: 'Episode 2' })
  expect(dialog).toHaveTextContent('Collision at 2.4 s12 steps, on simple-200')
  expect(within(dialog).queryByRole('alert')).not.toBeInTheDocument()
  expect(within(dialog).getByRole('button', { name: 'Download' })).toBeEnabled()
  // Two pictures at once would share one machine.
  expect(screen.queryByTitle('The robots in 3D')).not.toBeInTheDocument()
  await user.keyboard('{Escape}')
  await waitFor(() => expect(screen.queryByRole('dialog')).not.toBeInTheDocument())
  expect(screen.getByTitle('The robots in 3D')).toBeInTheDocument()
  expect(router.state.location.search).toBe('')
})

test('two policies are shown in one place, by a link that shows them again', async () => {
  const [mine] = replay.policies
  const other = { ...mine, of: 'policy:simple:simple-200', title: 'A simple arena', colour: '#ff922b' }
  const [lines] = episodeSeries.policies
  const server = startServer({
    ...routes,
    'GET /api/replays/checkpoint%3Acp2/1': replay,
    'GET /api/replays/checkpoint%3Acp2/1/series': episodeSeries,
    'GET /api/replays/checkpoint%3Acp2/beside': {
      suite: 'simple-200',
      items: [{ of: other.of, title: other.title, success: 0.97 }],
    },
    'GET /api/replays/checkpoint%3Acp2%2Cpolicy%3Asimple%3Asimple-200/1': {
      ...replay,
      page: '/replays/checkpoint:cp2,policy:simple:simple-200/1/',
      policies: [mine, { ...other, outcome: 'arrival', seconds: 4.8 }],
    },
    'GET /api/replays/checkpoint%3Acp2%2Cpolicy%3Asimple%3Asimple-200/1/series': {
      policies: [lines, { ...lines, of: other.of }],
    },
  })
  const { user, router } = open('/runs/run1?replay=2')
  const charts = await screen.findByTestId('replay-charts')
  expect(within(charts).getByRole('figure', { name: 'Range ahead, m' })).toBeInTheDocument()
  expect(within(charts).getByRole('figure', { name: 'Reward of each step' })).toHaveTextContent(
    /all.*collision/,
  )
  await user.click(await screen.findByPlaceholderText('Choose a policy'))
  await user.click(await screen.findByRole('option', { name: /A simple arena, 97/ }))
  await waitFor(() =>
    expect(screen.getByTitle('The episode in 3D')).toHaveAttribute(
      'src',
      '/replays/checkpoint:cp2,policy:simple:simple-200/1/light/',
    ),
  )
  expect(new URLSearchParams(router.state.location.search).getAll('with')).toEqual([other.of])
  expect(screen.getByTestId('replay-ends')).toHaveTextContent(
    /A.*Collision at 2.4 s.*BA simple arenaArrival at 4.8 s/,
  )
  // Of several, the reward is one line each: the sum, or the term that one chooses.
  expect(await screen.findByRole('combobox', { name: 'Term of the reward' })).toBeInTheDocument()
  expect(server.asked.filter((path) => path.endsWith('/progress')).length).toBeLessThan(5)
  await user.keyboard('{Escape}{Escape}')
  await waitFor(() => expect(screen.queryByRole('dialog')).not.toBeInTheDocument())
  expect(router.state.location.search).toBe('')
})

test('an episode is taken away in the form that one chooses; a refusal is said', async () => {
  let finish = () => {}
  const made = new Promise<void>((done) => {
    finish = done
  })
  const server = startServer({
    ...routes,
    'GET /api/replays/checkpoint%3Acp2/1': replay,
    'GET /api/replays/checkpoint%3Acp2/1/series': episodeSeries,
    'GET /api/replays/checkpoint%3Acp2/1/progress': { ready: false, share: 0.4 },
    'GET /api/replays/checkpoint:cp2/1/mp4': refusal(503, '200 jobs wait for a worker already.'),
    'GET /api/replays/checkpoint:cp2/1/gif': async () => {
      await made
      return new Response('GIF89a')
    },
  })
  const taken: string[] = []
  vi.spyOn(HTMLAnchorElement.prototype, 'click').mockImplementation(function (this: HTMLAnchorElement) {
    taken.push(`${this.getAttribute('href')} ${this.download === ''}`)
  })
  const { user } = open('/runs/run1?replay=2')
  const choose = async (form: string) => {
    await user.click(await screen.findByRole('button', { name: 'Download' }))
    await user.click(await screen.findByRole('menuitem', { name: new RegExp(`^${form}`) }))
  }
  await choose('GIF')
  expect(await screen.findByRole('button', { name: /^GIF: 40/ })).toBeDisabled()
  finish()
  await screen.findByRole('button', { name: 'Download' })
  expect(taken).toEqual(['/api/replays/checkpoint:cp2/1/gif?theme=light true'])
  expect(server.asked).toContain('/api/replays/checkpoint%3Acp2/1/progress?form=gif&theme=light')
  await choose('MP4')
  expect(await screen.findByText('200 jobs wait for a worker already.')).toBeInTheDocument()
  expect(taken).toHaveLength(1)
})

test('Back closes a replay that was opened here, and leaves the page where it is', async () => {
  startServer({ ...routes, 'GET /api/replays/checkpoint%3Acp2/1': replay })
  const { user, router } = open('/runs/run1')
  await user.click(await screen.findByRole('button', { name: 'Replay episode 2' }))
  await screen.findByRole('dialog', { name: 'Episode 2' })
  await router.navigate(-1)
  await waitFor(() => expect(screen.queryByRole('dialog')).not.toBeInTheDocument())
  expect(router.state.location.pathname + router.state.location.search).toBe('/runs/run1')
})

test('to close a replay that was opened here is to go back: nothing of it stays behind', async () => {
  startServer({ ...routes, 'GET /api/replays/checkpoint%3Acp2/1': replay })
  const { user, router } = open('/nowhere')
  await router.navigate('/runs/run1')
  await user.click(await screen.findByRole('button', { name: 'Replay episode 2' }))
  await screen.findByRole('dialog', { name: 'Episode 2' })
  await user.keyboard('{Escape}')
  await waitFor(() => expect(screen.queryByRole('dialog')).not.toBeInTheDocument())
  expect(router.state.location.pathname + router.state.location.search).toBe('/runs/run1')
  await router.navigate(-1)
  await waitFor(() => expect(router.state.location.pathname).toBe('/nowhere'))
})

test('one goes on from one failure to the next without closing the replay', async () => {
  startServer({
    ...routes,
    'GET /api/replays/checkpoint%3Acp2/1': replay,
    'GET /api/replays/checkpoint%3Acp2/4': { ...replay, episode: 4, page: '/replays/checkpoint:cp2/4/' },
  })
  // A link of before: counted from 0.
  const { user, router } = open('/runs/run1?episode=1')
  await screen.findByTestId('episodes')
  const next = await screen.findByRole('button', { name: 'Next' })
  await waitFor(() => expect(next).toBeEnabled())
  expect(screen.getByRole('button', { name: 'Previous' })).toBeDisabled()
  await user.click(next)
  await waitFor(() =>
    expect(screen.getByTitle('The episode in 3D')).toHaveAttribute('src', '/replays/checkpoint:cp2/4/light/'),
  )
  expect(router.state.location.search).toBe('?replay=5')
  expect(screen.getByRole('button', { name: 'Previous' })).toBeEnabled()
})

test('a replay that ended otherwise says so, and one that cannot be made says why', async () => {
  const server = startServer({
    ...routes,
    'GET /api/replays/checkpoint%3Acp2/1': {
      ...replay,
      policies: replay.policies.map((one) => ({ ...one, faithful: false })),
    },
  })
  const { router } = open('/runs/run1?step=100000&replay=2')
  expect(await screen.findByText(/ended otherwise than recorded/)).toBeInTheDocument()
  server.routes['GET /api/replays/checkpoint%3Acp2/2'] = refusal(500, 'The suite has changed.')
  await router.navigate('/runs/run1?replay=3')
  expect(await screen.findByText('The suite has changed.')).toBeInTheDocument()
  expect(screen.getByRole('button', { name: 'Try again' })).toBeInTheDocument()
})

test('what is wrong, with its evidence and what to try', async () => {
  const diagnosis = {
    id: 'kl_exploded',
    severity: 'error',
    title: 'KL divergence exploded',
    explanation: 'An update changed the policy by a KL divergence of 4.',
    evidence: [
      { metric: 'policy/kl', value: 4.0123, expected: 'below 0.05' },
      { metric: 'loss/value', value: null, expected: 'a finite number' },
    ],
    advice: ['Lower the learning rate.', 'Use fewer epochs.'],
    step: 90_000,
  }
  startServer({
    ...routes,
    'GET /api/runs/run1/diagnoses': { run_id: 'run1', step: 90_000, diagnoses: [diagnosis] },
  })
  open('/runs/run1')
  const finding = await screen.findByTestId('diagnosis-kl_exploded')
  expect(finding).toHaveTextContent('KL divergence exploded')
  const evidence = within(within(finding).getByRole('list', { name: 'Evidence' })).getAllByRole('listitem')
  expect(evidence.map((line) => line.textContent)).toEqual([
    'policy/kl 4.01 healthy: below 0.05',
    'loss/value not a number healthy: a finite number',
  ])
  expect(within(finding).getByText('Lower the learning rate.')).toBeInTheDocument()
})

test('a healthy run shows no diagnosis', async () => {
  const server = startServer({
    ...routes,
    'GET /api/runs/run1/diagnoses': { run_id: 'run1', step: 90_000, diagnoses: [] },
  })
  open('/runs/run1')
  await screen.findByTestId('vitals')
  await waitFor(() => expect(server.asked).toContain('/api/runs/run1/diagnoses'))
  expect(screen.queryByTestId('diagnoses')).not.toBeInTheDocument()
})

test('what happened, the newest first', async () => {
  startServer(routes)
  open('/runs/run1')
  const log = await screen.findByTestId('events')
  expect(
    within(log)
      .getAllByRole('listitem')
      .map((line) => line.textContent),
  ).toEqual([
    expect.stringContaining('Link lost for 2 s'),
    expect.stringMatching(/attempt 1.*UserWarning: old driver/),
    expect.stringContaining('Claimed by worker-1'),
  ])
})

test('the log is searched by the server, and downloaded', async () => {
  const server = startServer(routes)
  const { user } = open('/runs/run1')
  const panel = await screen.findByTestId('log')
  server.routes['GET /api/runs/run1/log'] = { total: 0, lines: [] }
  await user.type(within(panel).getByRole('textbox', { name: 'Search the log' }), 'driver')
  expect(await within(panel).findByText('No line holds this')).toBeInTheDocument()
  expect(server.asked).toContain('/api/runs/run1/log?limit=200&search=driver')
  expect(within(panel).getByRole('link', { name: 'Download' })).toHaveAttribute(
    'href',
    '/api/runs/run1/log/text',
  )
})

test('a choice about the view shows at once and is sent with the others', async () => {
  const server = startServer({ ...routes, 'PUT /api/runs/run1/live': live })
  const { user } = open('/runs/run1')
  const controls = await screen.findByRole('group', { name: 'Live view' })
  await waitFor(() => expect(within(controls).getByRole('radio', { name: '5×' })).toBeEnabled())
  await user.click(within(controls).getByRole('radio', { name: '5×' }))
  await waitFor(() => expect(server.changes).toHaveLength(1))
  const { status: _, ...settings } = live
  expect(server.changes[0]).toEqual({ route: 'PUT /api/runs/run1/live', body: { ...settings, speed: 5 } })
})

test.each([
  ['queued', checkpoints, 'Waiting for a free worker'],
  ['completed', noCheckpoints, 'ended before it kept a policy'],
  ['stopped', noCheckpoints, 'ended before it kept a policy'],
  ['failed', noCheckpoints, 'failed before it kept a policy'],
] as const)('a %s run has no robots to show, and says so', async (state, kept, text) => {
  startServer({
    ...routes,
    'GET /api/runs/run1': { ...runDetail, state },
    'GET /api/runs/run1/checkpoints': kept,
  })
  open('/runs/run1')
  expect(await screen.findByTestId('live-overlay')).toHaveTextContent(text)
  expect(screen.queryByTitle('The robots in 3D')).not.toBeInTheDocument()
})

test.each(['completed', 'stopped', 'failed'] as const)(
  'the best policy of a %s run drives as soon as somebody wants to watch',
  async (state) => {
    startServer({ ...routes, 'GET /api/runs/run1': { ...runDetail, state } })
    const { user } = open('/runs/run1')
    const watch = await screen.findByRole('button', { name: 'Watch the best policy' })
    expect(screen.queryByTitle('The robots in 3D')).not.toBeInTheDocument()
    await user.click(watch)
    expect(await screen.findByTitle('The robots in 3D')).toHaveAttribute('src', '/live/run1/')
    const controls = screen.getByRole('group', { name: 'Live view' })
    expect(controls).toHaveTextContent('The best policy, after training')
    // There are no training robots any more to choose.
    expect(within(controls).queryByRole('radio', { name: 'Training' })).not.toBeInTheDocument()
    await waitFor(() => expect(within(controls).getByRole('radio', { name: '10×' })).toBeEnabled())
  },
)

test('a queued run that nobody will take says so', async () => {
  startServer({
    ...routes,
    'GET /api/runs/run1': { ...runDetail, state: 'queued' },
    'GET /api/status': { ...status, workers: [], running: 0, queued: 1 },
  })
  open('/runs/run1')
  await waitFor(() => expect(screen.getByTestId('live-overlay')).toHaveTextContent('No worker is there'))
})

test('a failed run says why, and can be resumed', async () => {
  const server = startServer({
    ...routes,
    'GET /api/runs/run1': { ...runDetail, state: 'failed', error: 'The trainer ended with exit code 137' },
    'POST /api/runs/run1/resume': { ...runDetail, state: 'queued' },
  })
  const { user } = open('/runs/run1')
  expect(await screen.findByText('The trainer ended with exit code 137')).toBeInTheDocument()
  expect(screen.queryByRole('button', { name: 'Stop' })).not.toBeInTheDocument()
  await user.click(screen.getByRole('button', { name: 'Resume' }))
  await waitFor(() => expect(server.changes[0]?.route).toBe('POST /api/runs/run1/resume'))
})

test('a change that the server tells of is asked for', async () => {
  FakeEventSource.open = []
  const server = startServer(routes)
  open('/runs/run1')
  expect(await screen.findByTestId('vitals')).toHaveTextContent('Running')
  server.routes['GET /api/runs/run1'] = { ...runDetail, state: 'completed', step: 300_000 }
  await waitFor(() => expect(FakeEventSource.open).toHaveLength(1))
  FakeEventSource.open[0]?.send({ experiment_id: 'exp1', run_id: 'run1', kind: 'run' })
  await waitFor(() => expect(screen.getByTestId('vitals')).toHaveTextContent('Completed'))
})

test('a run that is not there', async () => {
  startServer({})
  open('/runs/gone')
  expect(await screen.findByText('There is no such run')).toBeInTheDocument()
})

test('a link to curves over episodes shows them, and what the trainer did not count is said', async () => {
  const series = (name: string, values: number[]) => ({
    name,
    steps: [4096, 8192],
    values,
    min: null,
    max: null,
  })
  startServer({
    ...routes,
    'GET /api/runs/run1/metrics': {
      series: [series('train/episodes', [12, 40]), series('train/success_rate', [0.1, 0.4])],
      attempt: 1,
      since: null,
    },
  })
  const { user } = open('/runs/run1?x=episodes')
  const main = within(await screen.findByTestId('main-curves'))
  await waitFor(() =>
    expect(main.getByRole('figure', { name: 'Success rate' })).toHaveAttribute('data-step', '40'),
  )
  const axis = main.getByRole('combobox', { name: 'Horizontal axis' })
  expect(axis).toHaveValue('episodes')
  expect(within(axis).getByRole('option', { name: 'Wall time, not counted' })).toBeDisabled()
  await user.selectOptions(axis, 'Steps')
  expect(main.getByRole('figure', { name: 'Success rate' })).toHaveAttribute('data-step', '8192')
})

test('a run from before time was counted says so in place of its curves', async () => {
  startServer(routes)
  open('/runs/run1?x=wall')
  const main = within(await screen.findByTestId('main-curves'))
  expect(
    (await main.findAllByText('Wall time was not counted when this run trained')).length,
  ).toBeGreaterThan(0)
})

test('a run whose curves were thinned says so beside its charts, and so does one that will be', async () => {
  const ended = { ...runDetail, state: 'completed', steps_per_second: null, seconds_left: null }
  startServer({
    ...routes,
    'GET /api/runs/run1': { ...ended, thinned: { since: NOW - 100, points: 4_300_000, kept: 43_000 } },
  })
  const { unmount } = open('/runs/run1')
  expect(await screen.findByTestId('thinned')).toHaveTextContent(
    /^Curves were thinned on .*: of 4.300.000 points 43.000 means of neighbours are left/,
  )
  unmount()
  startServer({ ...routes, 'GET /api/runs/run1': { ...ended, thins_at: NOW + 9e4 } })
  open('/runs/run1')
  expect(await screen.findByTestId('thinned')).toHaveTextContent(/^A rule thins these curves on/)
})

test('logarithmic axes are kept in the address, and where there can be none the chart says why', async () => {
  const series = (name: string, values: number[]) => ({
    name,
    steps: [4096, 8192],
    values,
    min: null,
    max: null,
  })
  startServer({
    ...routes,
    'GET /api/runs/run1/metrics': {
      series: [series('train/success_rate', [0, 0.4]), series('train/return', [10, 400])],
      attempt: 1,
      since: null,
    },
  })
  const { router, user } = open('/runs/run1')
  const main = within(await screen.findByTestId('main-curves'))
  await user.click(main.getByRole('checkbox', { name: 'Log axis of Return, per episode' }))
  expect(router.state.location.search).toBe('?ylog=Return%2C+per+episode')
  expect(main.queryByText(/Drawn linearly/)).not.toBeInTheDocument()
  await user.click(main.getByRole('checkbox', { name: 'Log axis of Success rate' }))
  expect(
    main.getByText(/Drawn linearly: a logarithmic axis has no place for values of 0 or below/),
  ).toBeVisible()
  await user.click(main.getByRole('checkbox', { name: 'Log horizontal axis' }))
  expect(router.state.location.search).toBe('?xlog=1&ylog=Return%2C+per+episode&ylog=Success+rate')
})

test('any metric of a run becomes a panel of one’s own', async () => {
  startServer({
    ...routes,
    'GET /api/runs/run1/metrics': {
      series: ['mine/bumps', 'train/success_rate'].map((name) => ({
        name,
        steps: [4096, 8192],
        values: [0.1, 0.4],
        min: null,
        max: null,
      })),
      attempt: 1,
      since: null,
    },
  })
  const { router, user } = open('/runs/run1')
  await user.click(await screen.findByRole('tab', { name: 'Chosen' }))
  await user.click(await screen.findByRole('button', { name: 'Panels' }))
  await user.type(await screen.findByRole('combobox', { name: 'Add a panel' }), 'bumps')
  await user.click(await screen.findByRole('option', { name: 'mine/bumps' }))
  expect(await screen.findByRole('figure', { name: 'mine/bumps' })).toBeInTheDocument()
  expect(router.state.location.search).toContain('panel=mine%2Fbumps')
})

test('a link to chosen panels opens them', async () => {
  startServer(routes)
  open('/runs/run1?panel=policy/kl')
  expect(await screen.findByRole('tab', { name: 'Chosen' })).toHaveAttribute('aria-selected', 'true')
  expect(await screen.findByRole('heading', { name: /KL divergence/ })).toBeInTheDocument()
})
