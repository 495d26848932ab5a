import { screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import { episodes, field, form, live, policy, replay } from '../testing/examples'
import { open } from '../testing/render'
import { FakeEventSource, refusal, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const { checkpoint_id: _, ...policyEpisodes } = episodes

const routes = {
  'GET /api/field': field,
  'GET /api/policies': [policy],
  'GET /api/policies/crowd': policy,
  'GET /api/policies/crowd/live': live,
  'GET /api/policies/crowd/suites/simple-200/episodes': policyEpisodes,
  'GET /api/policies/crowd/suites/clutter-500/episodes': { ...policyEpisodes, suite: 'clutter-500' },
  'GET /api/training/form': form,
}

test('every policy with its figures, and what can be done with it', async () => {
  startServer(routes)
  const { user } = open('/policies')
  const card = await screen.findByTestId('policy')
  expect(card).toHaveTextContent('Drives between 17 obstacles.')
  expect(card).toHaveTextContent(
    /simple-200\s*99\.0\s%.*N = 200\s*Over the 200 episodes of one policy\.\s*dynamic window, untrained: 98\.0\s%/,
  )
  expect(card).toHaveTextContent(
    /clutter-500\s*95\.0\s%.*N = 500\s*Over the 500 episodes of one policy\.\s*dynamic window, untrained: 99\.8\s%/,
  )
  expect(within(card).getByRole('link', { name: 'Watch Crowd' })).toHaveAttribute('href', '/policies/crowd')
  expect(within(card).getByRole('link', { name: 'Train one like it: Crowd' })).toHaveAttribute(
    'href',
    '/new?policy=crowd',
  )
  expect(within(card).getByRole('link', { name: 'Fine-tune Crowd' })).toHaveAttribute(
    'href',
    '/new?shipped=crowd',
  )
  await user.click(within(card).getByRole('button', { name: 'Download Crowd' }))
  const menu = await screen.findByRole('menu')
  expect(
    within(menu)
      .getAllByRole('menuitem')
      .map((item) => item.getAttribute('href')),
  ).toEqual(['/api/policies/crowd/download', '/api/policies/crowd/bundle'])
})

test('every family stands there, the hardest first, beside baselines that see as much', async () => {
  startServer(routes)
  open('/policies')
  const table = await screen.findByRole('table', { name: 'Success by family' })
  expect(
    within(table)
      .getAllByRole('columnheader')
      .map((cell) => cell.textContent),
  ).toEqual(['Who drives', 'Maze', 'Clutter'])
  expect(within(table).getByText('See 360° with 60 rays')).toBeInTheDocument()
  const [crowd, baseline, mine] = within(table).getAllByTestId('field-row')
  expect(crowd).toHaveTextContent(/Crowd19\.0\s%.*worst tenth 0\.00, N = 100.*99\.0\s%.*worst tenth 0\.62/)
  expect(within(crowd as HTMLElement).getByRole('link', { name: 'Crowd' })).toHaveAttribute(
    'href',
    '/policies/crowd',
  )
  expect(baseline).toHaveTextContent(/Dynamic window18\.0\s%.*–$/)
  expect(mine).toHaveTextContent(/Mine, step 200–93\.0\s%/)
  expect(within(mine as HTMLElement).getByRole('link')).toHaveAttribute(
    'href',
    '/evaluations/ev1?outcome=arrival',
  )
})

test('seeds of a training lead to the board that has them together, and what was never measured is left out', async () => {
  const seen = field.asked[0]?.cells[1]
  if (!seen) throw new Error('no cell')
  const seeds = { ...seen, success: { ...seen.success, seeds: 3, episodes: 1500 } }
  const base = { title: 'base', policy: null, trained: true }
  const asked = [
    { ...base, cells: [null, seeds] },
    { ...base, title: 'Nowhere', cells: [null, null] },
  ]
  startServer({ ...routes, 'GET /api/field': { ...field, asked } })
  open('/policies')
  const row = (await screen.findByText('base')).closest('tr') as HTMLElement
  expect(within(row).getByRole('link')).toHaveAttribute('href', '/leaderboards/abc')
  expect(row).toHaveTextContent(/N = 1\s500/)
  expect(screen.queryByText('Nowhere')).not.toBeInTheDocument()
  expect(screen.getByText(/scroll the table to the right/)).toBeInTheDocument()
})

test('where nothing was asked for, it says how', async () => {
  startServer({ ...routes, 'GET /api/field': { ...field, asked: [] } })
  open('/policies')
  expect(await screen.findByRole('link', { name: 'Evaluate' })).toHaveAttribute('href', '/evaluations')
})

test('a matrix that does not come leaves the policies', async () => {
  startServer({ ...routes, 'GET /api/field': refusal(500, 'The file is gone.') })
  open('/policies')
  expect(await screen.findByText('The file is gone.')).toBeInTheDocument()
  expect(screen.getByTestId('policy')).toBeInTheDocument()
})

test('a list that does not come says so', async () => {
  startServer({ 'GET /api/policies': refusal(500, 'The disk is full.') })
  open('/policies')
  expect(await screen.findByText('The disk is full.')).toBeInTheDocument()
})

test('a policy drives when one asks for it, beside how it was made', async () => {
  const server = startServer({ ...routes, 'PUT /api/policies/crowd/live': live })
  const { user } = open('/policies/crowd')
  const watch = await screen.findByRole('button', { name: 'Watch it drive' })
  expect(screen.queryByTitle('The robots in 3D')).not.toBeInTheDocument()
  await user.click(watch)
  expect(await screen.findByTitle('The robots in 3D')).toHaveAttribute('src', '/live/policy-crowd/')
  expect(screen.getByText('python -m workers.shipped.build crowd')).toBeInTheDocument()
  expect(screen.getByText(/Step 250\s000 of 300\s000, the best on simple-200/)).toBeInTheDocument()
  const controls = screen.getByRole('group', { name: 'Live view' })
  await waitFor(() => expect(within(controls).getByRole('radio', { name: '5×' })).toBeEnabled())
  await user.click(within(controls).getByRole('radio', { name: '5×' }))
  await waitFor(() => expect(server.changes[0]?.route).toBe('PUT /api/policies/crowd/live'))
  expect(server.changes[0]?.body).toMatchObject({ speed: 5 })
})

test('its figures stand beside the baselines, suite by suite', async () => {
  startServer(routes)
  open('/policies/crowd')
  const table = await screen.findByTestId('policy-results')
  const rows = within(table).getAllByRole('row').slice(1)
  expect(rows.map((row) => row.textContent?.replace(/\d.*/, ''))).toEqual([
    'simple-',
    'Go-to-goal',
    'Dynamic window',
    'clutter-',
    'Go-to-goal',
    'Dynamic window',
  ])
  expect(rows[3]).toHaveTextContent(/95\.0\s%.*5\.0\s%0\s%0\.8592\.4/)
})

const onClutter = {
  ...routes,
  'GET /api/replays/policy%3Acrowd%3Aclutter-500/1': {
    ...replay,
    suite: 'clutter-500',
    page: '/replays/policy:crowd:clutter-500/1/',
  },
}

test('every episode of every suite can be replayed', async () => {
  startServer(onClutter)
  const { user, router } = open('/policies/crowd')
  await screen.findByRole('heading', { name: 'Episodes on simple-200' })
  await user.click(screen.getByRole('radio', { name: 'clutter-500' }))
  await user.click(await screen.findByRole('button', { name: 'Replay episode 2' }))
  expect(await screen.findByTitle('The episode in 3D')).toHaveAttribute(
    'src',
    '/replays/policy:crowd:clutter-500/1/light/',
  )
  expect(router.state.location.search).toBe('?suite=clutter-500&replay=2')
})

test('a link to a replay brings its suite along', async () => {
  startServer(onClutter)
  open('/policies/crowd?suite=clutter-500&replay=2')
  expect(await screen.findByTitle('The episode in 3D')).toHaveAttribute(
    'src',
    '/replays/policy:crowd:clutter-500/1/light/',
  )
  // The page behind the dialog.
  expect(screen.getByText('Episodes on clutter-500')).toBeInTheDocument()
})

test('a policy that is not there', async () => {
  startServer({})
  open('/policies/nobody')
  expect(await screen.findByText('There is no such policy')).toBeInTheDocument()
})
