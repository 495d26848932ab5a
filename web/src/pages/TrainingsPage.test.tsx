import { screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import { experiment, listed, status } from '../testing/examples'
import { open } from '../testing/render'
import { FakeEventSource, refusal, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const other = {
  ...listed,
  id: 'exp2',
  name: 'Maze',
  state: 'failed' as const,
  success: null,
  arena: 'complex',
  movers: 4,
}
const two = { items: [listed, other], total: 2 }

test('each training with its state, what it trains, and its success with interval and N', async () => {
  startServer({ 'GET /api/experiments': two })
  open('/')
  const rows = await screen.findAllByTestId('experiment')
  expect(rows).toHaveLength(2)
  const [first] = rows
  expect(first).toHaveTextContent('Corridor')
  expect(first).toHaveTextContent('Running')
  expect(first).toHaveTextContent('PPO, MLP')
  expect(first).toHaveTextContent(/98\.4\s%\s*96\.1–99\.3\s%\s*N = 2 seeds, none failed: up to 78 % may/)
  expect(rows[1]).toHaveTextContent('Failed')
  expect(rows[1]).toHaveTextContent('Complex, 4 moving · PPO, MLP')
  expect(document.title).toBe('Trainings – Mapless')
})

test('who has nothing yet is invited to launch the first', async () => {
  startServer({ 'GET /api/experiments': { items: [], total: 0 } })
  open('/')
  expect(await screen.findByRole('link', { name: 'Launch your first training' })).toHaveAttribute(
    'href',
    '/new',
  )
})

test('ticked trainings are compared', async () => {
  startServer({ 'GET /api/experiments': two })
  const { router, user } = open('/')
  await user.click(await screen.findByRole('checkbox', { name: 'Tick Corridor' }))
  await user.click(screen.getByRole('checkbox', { name: 'Tick Maze' }))
  await user.click(screen.getByRole('button', { name: 'Compare 2' }))
  await waitFor(() => expect(router.state.location.pathname).toBe('/compare'))
  expect(router.state.location.search).toBe('?experiment=exp1&experiment=exp2')
})

test('a thousand trainings come in pages, and what was ticked on one stays ticked on the next', async () => {
  const named = (index: number) => ({ ...listed, id: `exp${index}`, name: `Training ${index}` })
  startServer({
    'GET /api/experiments': (request: Request) => {
      const offset = Number(new URL(request.url).searchParams.get('offset'))
      return { items: Array.from({ length: 50 }, (_, index) => named(offset + index)), total: 1_030 }
    },
  })
  const { router, user } = open('/')
  await user.click(await screen.findByRole('checkbox', { name: 'Tick Training 0' }))
  await user.click(screen.getByRole('button', { name: 'Next page' }))
  await user.click(await screen.findByRole('checkbox', { name: 'Tick Training 50' }))
  expect(router.state.location.search).toBe('?page=2')
  expect(screen.getByText(/51–100 of 1\s030/)).toBeInTheDocument()
  await user.click(screen.getByRole('button', { name: 'Compare 2' }))
  await waitFor(() => expect(router.state.location.search).toBe('?experiment=exp0&experiment=exp50'))
})

test('more than fifty are not compared, and the button says why', async () => {
  const items = Array.from({ length: 51 }, (_, index) => ({
    ...listed,
    id: `exp${index}`,
    name: `T${index}`,
  }))
  startServer({ 'GET /api/experiments': { items, total: 51 } })
  const { user } = open('/')
  await screen.findAllByTestId('experiment')
  await user.click(screen.getByRole('checkbox', { name: 'Tick all' }))
  const button = screen.getByRole('button', { name: 'Compare 51' })
  expect(button).toBeDisabled()
  expect(button).toHaveAttribute('title', 'At most 50 can be laid side by side')
})

test('the search is the server’s', async () => {
  const server = startServer({ 'GET /api/experiments': two })
  const { user } = open('/')
  await user.type(await screen.findByRole('textbox', { name: 'Search by name' }), 'corr')
  await waitFor(() => expect(server.asked.some((path) => path.includes('query=corr'))).toBe(true))
})

test('deleting asks first', async () => {
  const server = startServer({
    'GET /api/experiments': two,
    'DELETE /api/experiments/exp1': new Response(null, { status: 204 }),
  })
  const { user } = open('/')
  await user.click(await screen.findByRole('button', { name: 'Actions for Corridor' }))
  await user.click(await screen.findByRole('menuitem', { name: 'Delete' }))
  expect(server.changes).toEqual([])
  const dialog = await screen.findByRole('dialog', { name: 'Delete “Corridor”?' })
  await user.click(within(dialog).getByRole('button', { name: 'Delete' }))
  await waitFor(() => expect(server.changes).toEqual([{ route: 'DELETE /api/experiments/exp1', body: null }]))
})

test('renaming', async () => {
  const server = startServer({ 'GET /api/experiments': two, 'PATCH /api/experiments/exp1': experiment })
  const { user } = open('/')
  await user.click(await screen.findByRole('button', { name: 'Actions for Corridor' }))
  await user.click(await screen.findByRole('menuitem', { name: 'Rename' }))
  const name = await screen.findByRole('textbox', { name: 'Name' })
  await user.clear(name)
  await user.type(name, 'Hallway{Enter}')
  await waitFor(() =>
    expect(server.changes).toEqual([{ route: 'PATCH /api/experiments/exp1', body: { name: 'Hallway' } }]),
  )
})

test('what the server refuses to do, it says why', async () => {
  startServer({
    'GET /api/experiments': two,
    'POST /api/experiments/exp1/stop': refusal(409, 'Nothing of it is going on.'),
  })
  const { user } = open('/')
  await user.click(await screen.findByRole('button', { name: 'Actions for Corridor' }))
  await user.click(await screen.findByRole('menuitem', { name: 'Stop' }))
  expect(await screen.findByText('Nothing of it is going on.')).toBeInTheDocument()
})

test('a server that is gone is said to be gone, and what was there stays', async () => {
  const server = startServer({ 'GET /api/experiments': two })
  open('/')
  await screen.findAllByTestId('experiment')
  vi.useFakeTimers({ shouldAdvanceTime: true })
  server.routes['GET /api/status'] = new TypeError('Failed to fetch')
  await vi.advanceTimersByTimeAsync(6_000)
  expect(await screen.findByTestId('offline')).toBeVisible()
  expect(screen.getByTestId('service-state')).toHaveTextContent('Offline')
  expect(screen.getAllByTestId('experiment')).toHaveLength(2)
  server.routes['GET /api/status'] = status
  await vi.advanceTimersByTimeAsync(6_000)
  expect(await screen.findByText(/2 workers, 1 running/)).toBeInTheDocument()
  vi.useRealTimers()
})

test('without a worker that is said where one looks', async () => {
  startServer({
    'GET /api/experiments': two,
    'GET /api/status': { ...status, workers: [], running: 0, queued: 3 },
  })
  open('/')
  expect(await screen.findByText('No worker, 3 queued')).toBeInTheDocument()
})
