import { screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import { comparison, curves, form, listed, profiles } from '../testing/examples'
import { open } from '../testing/render'
import { FakeEventSource, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const routes = {
  'GET /api/compare': comparison,
  'GET /api/compare/curves': curves,
  'GET /api/compare/profiles': profiles,
  'GET /api/training/form': form,
  'GET /api/experiments': { items: [listed], total: 1, next: null },
}

test('figures with intervals and N, warnings, curves, and what differs', async () => {
  const server = startServer(routes)
  open('/compare?experiment=exp1&experiment=exp2')
  const figures = await screen.findByTestId('figures')
  expect(figures).toHaveTextContent(/98\.4\s%\s*96\.1–99\.3\s%/)
  expect(figures).toHaveTextContent('2 seeds × 200 episodes')
  expect(figures).toHaveTextContent('not evaluated yet')
  expect(figures).toHaveTextContent(/Seeds: 98\.0\s%, 98\.8\s%None of 2 seeds failed: up to 78 % may/)
  expect(screen.getByTestId('warnings')).toHaveTextContent('Alone has not been evaluated yet.')
  const differences = await screen.findByTestId('differences')
  await waitFor(() =>
    expect(
      within(differences)
        .getAllByRole('row')
        .slice(1)
        .map((row) => row.textContent),
    ).toEqual([
      'Learning rateAlgorithm0.0010.0003',
      'Hidden layersNetwork64, 64–',
      'WeightProgress500left out',
    ]),
  )
  const [chart] = await screen.findAllByRole('figure', { name: 'Success rate' })
  expect(chart).toHaveTextContent('Corridor, 2 seeds')
  expect(chart).toHaveTextContent('Alone, 1 seed')
  expect(server.asked.some((path) => path.startsWith('/api/compare?experiment=exp1&experiment=exp2'))).toBe(
    true,
  )
})

test('a verdict in a word, with its reason, and refused where seeds are few', async () => {
  const server = startServer(routes)
  const { router, user } = open('/compare?experiment=exp1&experiment=exp2')
  const [, refused, better] = within(await screen.findByTestId('verdicts')).getAllByRole('row')
  expect(refused).toHaveTextContent(
    'AloneCorridorSuccessrefusedNo verdict below 5 seeds: Corridor has 2 to show.',
  )
  expect(better).toHaveTextContent('AloneCorridorSteps to the targetbetter8.1 steps to the target fewer')
  expect(better).toHaveTextContent('below 0.001')
  expect(better).toHaveTextContent('better in 120, worse in 41 of 180p = 0.012 (Holm)')
  expect(screen.getByText(/^1 comparison, seeds against seeds/)).toBeInTheDocument()

  const margin = screen.getByRole('textbox', { name: 'Success is equivalent within (points)' })
  await user.clear(margin)
  await user.type(margin, '5')
  expect(router.state.location.search).toBe('?experiment=exp1&experiment=exp2&margin=0.05')
  await vi.waitFor(() => expect(server.asked.at(-1)).toContain('margin=0.05'))
})

test('another base is kept in the address, and beside it what else is there', async () => {
  const server = startServer(routes)
  const { router, user } = open('/compare?experiment=exp1&experiment=exp2&margin=0.05')
  await user.selectOptions(await screen.findByRole('combobox', { name: 'Held against' }), 'Alone')
  expect(router.state.location.search).toBe('?experiment=exp1&experiment=exp2&margin=0.05&base=exp2')
  await vi.waitFor(() => expect(server.asked.some((path) => path.includes('base=exp2'))).toBe(true))
})

test('whole distributions: a profile, and how likely one improves on the other', async () => {
  startServer(routes)
  open('/compare?experiment=exp1&experiment=exp2')
  const table = await screen.findByRole('table', { name: 'Probability of improvement' })
  expect(table).toHaveTextContent(/AloneCorridor62\.0\s%\s*55\.0–69\.0\s%/)
  const profile = await screen.findByRole('figure', { name: 'Performance profile' })
  expect(profile).toHaveTextContent('Corridor, 2 seeds')
  expect(profile).not.toHaveTextContent('Alone')
})

test('who is left out of the probability of improvement is said, and no table is empty', async () => {
  startServer({ ...routes, 'GET /api/compare': { ...comparison, improvements: [] } })
  open('/compare?experiment=exp1&experiment=exp2')
  expect(await screen.findByTestId('improvements-left-out')).toHaveTextContent(
    'Left out: Corridor has 2 seeds evaluated, and it takes 5',
  )
  expect(screen.queryByRole('table', { name: 'Probability of improvement' })).not.toBeInTheDocument()
})

test('tables leave as one prints them, as they are judged on the page', async () => {
  startServer(routes)
  const { user } = open('/compare?experiment=exp1&experiment=exp2&base=exp2')
  await user.click(await screen.findByRole('button', { name: 'Export the table Verdicts' }))
  expect(await screen.findByRole('menuitem', { name: 'LaTeX (booktabs)' })).toHaveAttribute(
    'href',
    '/api/compare/table?experiment=exp1&experiment=exp2&margin=0.02&base=exp2&table=verdicts&format=latex',
  )
  expect(screen.getByRole('link', { name: 'Report (HTML)' })).toHaveAttribute(
    'href',
    '/api/compare/report?experiment=exp1&experiment=exp2&margin=0.02&base=exp2',
  )
})

test('with none chosen there is a list to choose from', async () => {
  startServer(routes)
  const { router, user } = open('/compare')
  await user.click(await screen.findByRole('checkbox', { name: 'Tick Corridor' }))
  await user.click(screen.getByRole('button', { name: 'Compare 1' }))
  expect(router.state.location.search).toBe('?experiment=exp1')
  expect(await screen.findByTestId('figures')).toBeInTheDocument()
})

const ONE_GONE = {
  ...routes,
  'GET /api/compare': (request: Request) =>
    new URL(request.url).searchParams.has('experiment', 'thrown')
      ? new Response(JSON.stringify({ detail: 'There is no experiment thrown' }), { status: 404 })
      : comparison,
  'GET /api/experiments/exp1': { ...listed, id: 'exp1', name: 'Corridor' },
  'GET /api/experiments/exp2': { ...listed, id: 'exp2', name: 'Alone' },
  'GET /api/experiments/thrown': () => new Response(JSON.stringify({ detail: 'gone' }), { status: 404 }),
  'GET /api/experiments': { items: [{ ...listed, id: 'thrown', name: 'Short sight' }], total: 1, next: null },
}

test('a deleted training is named and left out, and the others are compared', async () => {
  startServer(ONE_GONE)
  open('/compare?experiment=exp1&experiment=thrown&experiment=exp2')
  expect(await screen.findByTestId('gone')).toHaveTextContent(
    /1 of 3 trainings left outShort sight lies in the trash, from where it can be taken out again/,
  )
  expect(await screen.findByTestId('figures')).toHaveTextContent('Corridor')
})

test('where fewer than two remain, the page says so and how to go on', async () => {
  startServer(ONE_GONE)
  open('/compare?experiment=exp1&experiment=thrown')
  expect(await screen.findByRole('alert')).toHaveTextContent('Only Corridor is left of 2 trainings')
  expect(screen.getByRole('link', { name: 'Open Corridor' })).toHaveAttribute('href', '/experiments/exp1')
  expect(screen.getByRole('link', { name: 'the trash' })).toHaveAttribute('href', '/?place=trash')
})

test('curves over time under way: in the address, on a grid that is told, and who is left out', async () => {
  const overTime = {
    ...curves,
    across: 'wall',
    spacing: 'even',
    steps: [],
    x: [0, 3_600, 7_200],
    experiments: curves.experiments.map((one, index) => ({ ...one, unplaced: index })),
  }
  const server = startServer({
    ...routes,
    'GET /api/compare/curves': (request) =>
      new URL(request.url).searchParams.get('x') === 'wall' ? overTime : curves,
    'GET /api/compare/metrics': {
      runs: 3,
      metrics: [
        { name: 'time/wall_seconds', runs: 2 },
        { name: 'train/return', runs: 3 },
      ],
    },
  })
  const { router, user } = open('/compare?experiment=exp1&experiment=exp2')
  const axis = await screen.findByRole('combobox', { name: 'Horizontal axis' })
  expect(await within(axis).findByRole('option', { name: 'CPU time, not counted' })).toBeDisabled()
  await user.selectOptions(axis, 'Wall time')
  expect(router.state.location.search).toBe('?experiment=exp1&experiment=exp2&x=wall')
  await waitFor(() => expect(server.asked.some((path) => path.includes('x=wall'))).toBe(true))
  const [foot] = await screen.findAllByText(
    /^Means at 3 times evenly spaced, until the first seed is through; each/,
  )
  expect(foot).toHaveTextContent('1 run left out: Wall time was not counted when it trained')

  await user.selectOptions(axis, 'Steps')
  expect(router.state.location.search).toBe('?experiment=exp1&experiment=exp2')
  expect(screen.queryByText(/evenly spaced/)).not.toBeInTheDocument()
})

test('while its runs report only what is new of a curve is asked for', async () => {
  const server = startServer({ ...routes, 'GET /api/compare/curves': { ...curves, follow: 'known' } })
  open('/compare?experiment=exp1&experiment=exp2')
  await screen.findByTestId('figures')
  await waitFor(() => expect(FakeEventSource.open).toHaveLength(1))
  const asked = () => server.asked.filter((path) => path.includes('/api/compare/curves'))
  await waitFor(() => expect(asked().length).toBeGreaterThan(0))
  expect(asked().some((path) => path.includes('since='))).toBe(false)
  FakeEventSource.open[0]?.send({ experiment_id: 'exp1', run_id: 'run1', kind: 'run' })
  await waitFor(() => expect(asked().some((path) => path.includes('since=known'))).toBe(true), {
    timeout: 4_000,
  })
})

test('any metric that was reported becomes a panel, and the address keeps them in their order', async () => {
  const server = startServer({
    ...routes,
    'GET /api/compare/metrics': {
      runs: 3,
      metrics: ['eval/steps', 'eval/success_rate', 'loss/value', 'policy/kl', 'train/return'].map((name) => ({
        name,
        runs: 3,
      })),
    },
  })
  const { router, user } = open(
    '/compare?experiment=exp1&experiment=exp2&panel=train/return&panel=loss/value',
  )
  expect(await screen.findByRole('figure', { name: 'Value loss' })).toBeInTheDocument()
  expect(screen.queryByRole('figure', { name: 'Success rate' })).not.toBeInTheDocument()

  await user.click(screen.getByRole('button', { name: 'Panels' }))
  const search = await screen.findByRole('combobox', { name: 'Add a panel' })
  // By their words, under the headings of a run's page; by their names in the code, too.
  await user.type(search, 'steps target')
  const metrics = within(await screen.findByRole('listbox'))
  expect(metrics.getAllByRole('option').map(({ textContent }) => textContent)).toEqual([
    'Steps to the target, evaluationeval/steps',
  ])
  expect(metrics.getByText('Evaluation')).toBeInTheDocument()
  await user.clear(search)
  await user.type(search, 'policy/k')
  await user.click(await screen.findByRole('option', { name: /^KL divergence, old to new policy/ }))
  await user.click(screen.getByRole('button', { name: 'Move KL divergence, old to new policy up' }))
  await user.click(screen.getByRole('button', { name: 'Remove Return, per episode, training' }))
  expect(router.state.location.search).toBe(
    '?experiment=exp1&experiment=exp2&panel=policy%2Fkl&panel=loss%2Fvalue',
  )
  expect(await screen.findByRole('figure', { name: 'KL divergence' })).toBeInTheDocument()
  expect(server.asked.some((path) => path.includes('name=policy%2Fkl'))).toBe(true)
  expect(screen.getByRole('link', { name: 'Report (HTML)' })).toHaveAttribute(
    'href',
    '/api/compare/report?experiment=exp1&experiment=exp2&margin=0.02&name=policy%2Fkl&name=loss%2Fvalue',
  )

  await user.click(screen.getByRole('button', { name: 'Remove KL divergence, old to new policy' }))
  expect(screen.getByRole('button', { name: 'Remove Value loss' })).toBeDisabled()
  await user.click(screen.getByRole('button', { name: 'Usual' }))
  expect(router.state.location.search).toBe('?experiment=exp1&experiment=exp2')
  await waitFor(() => expect(screen.getAllByRole('figure', { name: 'Success rate' })).toHaveLength(2))
})
