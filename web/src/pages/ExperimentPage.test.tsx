import { screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import { curves, experiment, form, training } from '../testing/examples'
import { open } from '../testing/render'
import { FakeEventSource, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const routes = {
  'GET /api/experiments/exp1': { ...experiment, training: { ...training, steps: 600_000 } },
  'GET /api/compare/curves': curves,
  'GET /api/training/form': form,
}

test('its runs, its success with what stands behind it, and what differs from the defaults', async () => {
  startServer(routes)
  open('/experiments/exp1')
  const runs = await screen.findAllByTestId('run')
  expect(runs.map((run) => run.textContent?.slice(0, 6))).toEqual(['Seed 0', 'Seed 1'])
  expect(screen.getByRole('link', { name: 'Seed 1' })).toHaveAttribute('href', '/runs/run2')
  expect(
    screen.getByText(
      /^Over 2 seeds, 400 episodes: 98\.0\s%, 98\.8\s%\. None of 2 seeds failed: up to 78 % may/,
    ),
  ).toBeInTheDocument()
  expect(await screen.findByText(/default 300\s000/)).toBeInTheDocument()
  expect(screen.getByRole('link', { name: 'Duplicate' })).toHaveAttribute('href', '/new?from=exp1')
})

test('stopping it stops its runs', async () => {
  const server = startServer({ ...routes, 'POST /api/experiments/exp1/stop': experiment })
  const { user } = open('/experiments/exp1')
  await user.click(await screen.findByRole('button', { name: 'Stop' }))
  await waitFor(() => expect(server.changes[0]?.route).toBe('POST /api/experiments/exp1/stop'))
})

test('how many of its runs are under way at a time is said, changed and given up', async () => {
  const server = startServer({ ...routes, 'PATCH /api/experiments/exp1': experiment })
  const { user } = open('/experiments/exp1')
  const button = await screen.findByRole('button', { name: 'No limit of its own: Corridor' })
  expect(button).toHaveTextContent('No limit of its own')
  await user.click(button)
  const number = await screen.findByRole('textbox', { name: 'At most at a time' })
  await user.type(number, '2')
  await user.click(screen.getByRole('button', { name: 'Save' }))
  await waitFor(() =>
    expect(server.changes).toEqual([{ route: 'PATCH /api/experiments/exp1', body: { parallel_runs: 2 } }]),
  )
  await waitFor(() => expect(number).not.toBeInTheDocument())
  await user.click(button)
  await user.click(screen.getByRole('button', { name: 'Save' }))
  await waitFor(() => expect(server.changes[1]?.body).toEqual({ parallel_runs: 0 }))
})

test('notes are Markdown without their HTML, and are written here', async () => {
  const marks = {
    tags: ['baseline'],
    starred: false,
    archived: false,
    notes: '**Why** <img src=x onerror=alert(1)> [bad](javascript:alert(1))',
  }
  const server = startServer({
    ...routes,
    'GET /api/experiments/exp1/marks': marks,
    'PUT /api/experiments/exp1/notes': marks,
  })
  const { user } = open('/experiments/exp1')
  expect((await screen.findByText('Why')).tagName).toBe('STRONG')
  expect(document.querySelector('img[src="x"]')).toBeNull()
  expect(screen.getByText('bad')).not.toHaveAttribute('href', expect.stringContaining('javascript'))
  expect(screen.getByText('baseline')).toBeInTheDocument()
  await user.click(screen.getByRole('button', { name: 'Edit' }))
  const text = await screen.findByRole('textbox', { name: 'Markdown' })
  await user.clear(text)
  await user.type(text, 'Better')
  await user.click(screen.getByRole('button', { name: 'Save' }))
  await waitFor(() =>
    expect(server.changes).toEqual([{ route: 'PUT /api/experiments/exp1/notes', body: { notes: 'Better' } }]),
  )
})

test('seeds are added behind the last', async () => {
  const server = startServer({
    ...routes,
    'POST /api/experiments/exp1/seeds': new Response(null, { status: 204 }),
  })
  const { user } = open('/experiments/exp1')
  await user.click(await screen.findByRole('button', { name: 'Seeds' }))
  await user.click(await screen.findByRole('button', { name: 'Train' }))
  await waitFor(() => expect(server.changes[0]?.body).toEqual({ seeds: [2, 3, 4, 5] }))
})

test('its parent and what was trained further from it are told', async () => {
  startServer({
    'GET /api/training/form': form,
    'GET /api/experiments/exp1': experiment,
    'GET /api/experiments/exp1/lineage': {
      parent: {
        start_from: {
          source: 'checkpoint',
          name: 'cp9',
          sha256: 'cd'.repeat(32),
          title: 'Maze, seed 1, step 9 000',
        },
        state: 'there',
        run_id: 'run9',
        step: 9000,
      },
      children: [{ id: 'exp7', name: 'Finer', seed: 0, step: 100_000 }],
    },
  })
  open('/experiments/exp1')
  const lineage = await screen.findByTestId('lineage')
  expect(within(lineage).getByRole('link', { name: 'Maze, seed 1, step 9 000' })).toHaveAttribute(
    'href',
    '/runs/run9?step=9000',
  )
  expect(within(lineage).getByRole('link', { name: 'Finer' })).toHaveAttribute('href', '/experiments/exp7')
  expect(lineage).toHaveTextContent(/from seed 0, step 100\s000/)
})

test('a parent that is gone, or not to be seen, is named without a link', async () => {
  const parent = {
    start_from: {
      source: 'checkpoint',
      name: 'cp9',
      sha256: 'cd'.repeat(32),
      title: 'Maze, seed 1, step 9 000',
    },
    state: 'gone',
    run_id: null,
    step: null,
  }
  const server = startServer({
    'GET /api/training/form': form,
    'GET /api/experiments/exp1': experiment,
    'GET /api/experiments/exp1/lineage': { parent, children: [] },
  })
  const { unmount } = open('/experiments/exp1')
  expect(await screen.findByTestId('lineage')).toHaveTextContent('Maze, seed 1, step 9 000 (deleted)')
  unmount()
  server.routes['GET /api/experiments/exp1/lineage'] = {
    parent: { ...parent, state: 'hidden' },
    children: [],
  }
  open('/experiments/exp1')
  expect(await screen.findByTestId('lineage')).toHaveTextContent("in a project that you don't see")
})
