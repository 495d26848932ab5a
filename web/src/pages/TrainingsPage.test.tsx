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
  arena_title: 'Complex',
  movers: 4,
}
const two = { items: [listed, other], total: 2, next: null }

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
  expect(rows[1]).toHaveTextContent('Complex')
  expect(document.title).toBe('Trainings – Mapless')
})

test('the list is asked for once, while it is drawn', async () => {
  const server = startServer({ 'GET /api/experiments': two })
  open('/')
  await screen.findAllByTestId('experiment')
  expect(server.asked.filter((path) => path.startsWith('/api/experiments'))).toEqual([
    '/api/experiments?place=live&query=&sort=-created&limit=100',
  ])
})

test('who has nothing yet is invited to launch the first', async () => {
  startServer({ 'GET /api/experiments': { items: [], total: 0, next: null } })
  open('/')
  expect(await screen.findByRole('link', { name: 'Launch your first training' })).toHaveAttribute(
    'href',
    '/new',
  )
})

test('one looks at a project, and goes on with it', async () => {
  const named = (id: string, name: string) => ({ id, name, created_at: 1, experiments: 1, role: 'editor' })
  const server = startServer({
    'GET /api/experiments': two,
    'GET /api/projects': { items: [named('p1', 'Halls'), named('p2', 'Streets')], total: 2 },
  })
  const { router, user } = open('/')
  await user.click(await screen.findByRole('combobox', { name: 'Project' }))
  await user.click(await screen.findByRole('option', { name: 'Streets' }))
  await waitFor(() => expect(router.state.location.search).toBe('?project=p2'))
  await waitFor(() => expect(server.asked.at(-1)).toContain('project=p2'))
  await router.navigate('/compare')
  expect(await screen.findByRole('combobox', { name: 'Project' })).toHaveValue('Streets')
  localStorage.clear()
})

test('a project that was chosen some time and is gone hides nothing', async () => {
  localStorage.setItem('mapless.project', 'gone')
  startServer({
    'GET /api/experiments': (request: Request) =>
      new URL(request.url).searchParams.has('project') ? { items: [], total: 0, next: null } : two,
    'GET /api/projects': {
      items: [{ id: 'p1', name: 'Halls', created_at: 1, experiments: 2, role: 'editor' }],
      total: 1,
    },
  })
  open('/')
  expect(await screen.findByRole('link', { name: 'Corridor' })).toBeInTheDocument()
  expect(localStorage.getItem('mapless.project')).toBeNull()
})

test('ticked trainings are compared', async () => {
  startServer({ 'GET /api/experiments': two })
  const { router, user } = open('/')
  await user.click(await screen.findByRole('checkbox', { name: 'Tick Corridor' }))
  await user.click(screen.getByRole('checkbox', { name: 'Tick Maze' }))
  await user.click(screen.getByRole('link', { name: 'Compare 2' }))
  await waitFor(() => expect(router.state.location.pathname).toBe('/compare'))
  expect(router.state.location.search).toBe('?experiment=exp1&experiment=exp2')
})

test('of a thousand trainings those in sight are drawn; by keyboard they are ticked and opened', async () => {
  const named = (index: number) => ({ ...listed, id: `exp${index}`, name: `Training ${index}` })
  startServer({
    'GET /api/experiments': (request: Request) => {
      const after = Number(new URL(request.url).searchParams.get('after') ?? 0)
      const items = Array.from({ length: 100 }, (_, index) => named(after + index))
      return { items, total: 1_030, next: String(after + 100) }
    },
  })
  const { router, user } = open('/')
  await user.click(await screen.findByRole('checkbox', { name: 'Tick Training 0' }))
  expect(screen.getAllByTestId('experiment').length).toBeLessThan(60)
  expect(screen.getByText(/1\s030 trainings/)).toBeInTheDocument()
  screen.getAllByTestId('experiment')[0]?.focus()
  await user.keyboard('{ArrowDown}')
  await waitFor(() => expect(document.activeElement).toHaveTextContent('Training 1'))
  await user.keyboard(' ')
  expect(screen.getByRole('checkbox', { name: 'Tick Training 1' })).toBeChecked()
  await user.keyboard('{Enter}')
  await waitFor(() => expect(router.state.location.pathname).toBe('/experiments/exp1'))
})

test('more than fifty are not compared, and the button says why', async () => {
  const items = Array.from({ length: 51 }, (_, index) => ({
    ...listed,
    id: `exp${index}`,
    name: `T${index}`,
  }))
  startServer({ 'GET /api/experiments': { items, total: 51, next: null } })
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
  await user.type(await screen.findByRole('textbox', { name: 'Search and filter' }), 'corr')
  await waitFor(() => expect(server.asked.some((path) => path.includes('query=corr'))).toBe(true))
})

test('a query that makes no sense is marked where it is at fault', async () => {
  const detail = [{ loc: ['query', 'query'], msg: 'No such key.', type: 'value_error', ctx: { position: 6 } }]
  startServer({ 'GET /api/experiments': refusal(422, detail) })
  open('/?q=alpha+gamme+%3D+1')
  const fault = await screen.findByRole('alert')
  expect(fault).toHaveTextContent('No such key.')
  expect(fault.querySelector('mark')).toHaveTextContent('gamme')
})

test('what the columns, the order and the place are is in the address', async () => {
  const server = startServer({ 'GET /api/experiments': two })
  open('/?columns=state,train/return&sort=-train/return&place=archived&q=corr')
  expect(await screen.findByRole('columnheader', { name: /train\/return/ })).toHaveAttribute(
    'aria-sort',
    'descending',
  )
  const asked = new URLSearchParams(
    server.asked.find((path) => path.startsWith('/api/experiments?'))?.split('?')[1],
  )
  expect(Object.fromEntries(asked)).toMatchObject({
    query: 'corr',
    sort: '-train/return',
    place: 'archived',
    column: 'train/return',
  })
})

test('several trainings are deleted at once, and taken back', async () => {
  const server = startServer({
    'GET /api/experiments': two,
    'POST /api/workbench/actions': { done: ['exp1', 'exp2'], left_out: [] },
  })
  const { user } = open('/')
  await screen.findAllByTestId('experiment')
  await user.click(screen.getByRole('checkbox', { name: 'Tick all' }))
  const bar = screen.getByRole('region', { name: 'Ticked trainings' })
  await user.click(within(bar).getByRole('button', { name: 'Delete' }))
  await user.click(await screen.findByRole('button', { name: 'Undo' }))
  await waitFor(() =>
    expect(server.changes.map(({ body }) => (body as { action: string }).action)).toEqual([
      'delete',
      'restore',
    ]),
  )
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

test('the data of all runs are exported', async () => {
  startServer({ 'GET /api/experiments': two })
  const { user } = open('/')
  await user.click(await screen.findByRole('button', { name: 'Actions for Corridor' }))
  for (const [name, format] of [
    ['Curves, CSV', 'csv'],
    ['Curves, TensorBoard', 'tensorboard'],
    ['Settings and episodes, JSON', 'json'],
  ] as const) {
    const item = await screen.findByRole('menuitem', { name })
    expect(item).toHaveAttribute('href', `/api/experiments/exp1/export?format=${format}`)
  }
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
