import { screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import type { ArenaSummary, ArenaView } from '../api/types'
import { arenaFacts, arenaFromSearch } from '../lib/arenas'
import { form } from '../testing/examples'
import { open } from '../testing/render'
import { FakeEventSource, refusal, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const HASH = 'a'.repeat(64)

const movers = { count: 0, kind: 'pedestrian', speed: 1, radius: 0.25, sees_robots: false } as const

const GALLERY: ArenaSummary[] = [
  { kind: 'fixed', key: 'simple', title: 'Simple', config: { name: 'simple', movers }, imported_at: null },
  {
    kind: 'generated',
    key: 'maze',
    title: 'Maze',
    config: {
      name: 'maze',
      difficulty: 0.5,
      maps: 64,
      seed: 0,
      own_maps: false,
      map_sampling: 'uniform',
      movers,
    },
    imported_at: null,
  },
  {
    kind: 'imported',
    key: HASH,
    title: 'Lab',
    config: { name: 'imported', sha256: HASH, arena: null, movers },
    imported_at: 1,
  },
]

const LAB: ArenaView = {
  title: 'Lab',
  config: { name: 'imported', sha256: HASH, arena: null, movers },
  geometry: {
    format: 'mapless-arena/1',
    name: 'Lab',
    width: 8,
    height: 6,
    circles: [{ x: 1, y: 0.5, radius: 0.3 }],
    boxes: [{ x: -2, y: 0, length: 2, width: 0.5, angle: 30 }],
    movers: [],
    start: null,
    target: null,
  },
  obstacles: 2,
  free_area: 39.4,
  free_share: 0.82,
  known: false,
  trainings: 0,
}

function start(routes = {}) {
  return startServer({
    'GET /api/arenas': GALLERY,
    'GET /api/arenas/fixed': { ...LAB, title: 'Simple' },
    'GET /api/arenas/generated': { ...LAB, title: 'Maze' },
    [`GET /api/arenas/imported/${HASH}`]: LAB,
    'GET /api/training/form': form,
    ...routes,
  })
}

const card = async (name: string) => {
  const heading = await screen.findByRole('heading', { name })
  return within(heading.closest('li') as HTMLElement)
}

test('every arena is drawn, to scale, with what it is', async () => {
  start()
  open('/arenas')
  const lab = await card('Lab')
  const drawing = await lab.findByRole('img', { name: 'Lab from above' })
  expect(drawing.querySelectorAll('circle')).toHaveLength(1)
  expect(drawing.querySelector('circle')).toHaveAttribute('r', '0.3')
  expect(drawing.querySelector('g rect')).toHaveAttribute('transform', 'translate(-2 0) rotate(30)')
  expect(lab.getByText(/8 × 6 m · 2 obstacles · 82/)).toBeInTheDocument()
  expect((await card('Maze')).getByRole('slider')).toHaveAttribute('aria-valuenow', '0.5')
})

test('what moves is counted, and the rounds of patrols are drawn', async () => {
  const round = [
    { x: -3, y: 1 },
    { x: 3, y: 1 },
  ]
  const moving = [
    { kind: 'patrol' as const, radius: 0.25, speed: 1, waypoints: round },
    { kind: 'pedestrian' as const, radius: 0.25, speed: 1 },
  ]
  start({ [`GET /api/arenas/imported/${HASH}`]: { ...LAB, geometry: { ...LAB.geometry, movers: moving } } })
  open('/arenas')
  const lab = await card('Lab')
  expect(await lab.findByText(/2 obstacles · 2 moving · 82/)).toBeInTheDocument()
  const drawing = lab.getByRole('img', { name: 'Lab from above' })
  expect(drawing.querySelector('polygon')).toHaveAttribute('points', '-3,1 3,1')
})

test('the difficulty is what is drawn, and what the training starts with', async () => {
  const server = start()
  const { router, user } = open('/arenas')
  const maze = await card('Maze')
  maze.getByRole('slider').focus()
  await user.keyboard('{ArrowRight}{ArrowRight}')
  await waitFor(() => expect(server.asked).toContain('/api/arenas/generated?name=maze&difficulty=0.6&seed=0'))
  await user.click(maze.getByRole('button', { name: 'Another map of Maze' }))
  await user.click(maze.getByRole('link', { name: 'Train on it' }))
  await waitFor(() => expect(router.state.location.pathname).toBe('/new'))
  const chosen = new URLSearchParams(router.state.location.search).get('arena')
  expect(arenaFromSearch(chosen)).toEqual({
    name: 'maze',
    difficulty: 0.6,
    maps: 64,
    seed: 1,
    own_maps: false,
    map_sampling: 'uniform',
    movers,
  })
})

test('the launch form takes the chosen arena, and ignores what is none', async () => {
  const server = start({ 'POST /api/experiments': new Error('offline') })
  const { user } = open(`/new?arena=${encodeURIComponent('{"name":"complex"}')}`)
  await user.click(await screen.findByRole('button', { name: 'Launch' }))
  expect(server.changes.at(-1)?.body).toMatchObject({ training: { task: { arena: { name: 'complex' } } } })
  for (const text of [null, '', 'complex', '[1]', '{"size":3}']) expect(arenaFromSearch(text)).toBeNull()
})

test('an upload is shown before it is kept', async () => {
  const server = start({ 'POST /api/arenas/imported': LAB })
  const { user } = open('/arenas')
  await card('Lab')
  const input = document.querySelector('input[type=file]') as HTMLInputElement
  await user.upload(input, new File(['name: Lab'], 'lab.yaml'))
  const dialog = within(await screen.findByRole('dialog'))
  expect(dialog.getByRole('img', { name: 'Lab from above' })).toBeInTheDocument()
  const files = [{ name: 'lab.yaml', content: btoa('name: Lab') }]
  expect(server.changes.map(({ body }) => body)).toEqual([{ files, keep: false }])
  await user.click(dialog.getByRole('button', { name: 'Import' }))
  await waitFor(() => expect(screen.queryByRole('dialog')).not.toBeInTheDocument())
  expect(server.changes.at(-1)?.body).toEqual({ files, keep: true })
})

test('a refused file says why', async () => {
  start({ 'POST /api/arenas/imported': refusal(422, 'a.world: no obstacle in it') })
  const { user } = open('/arenas')
  await card('Lab')
  const input = document.querySelector('input[type=file]') as HTMLInputElement
  await user.upload(input, new File(['<sdf/>'], 'a.world'))
  expect(await screen.findByText('a.world: no obstacle in it')).toBeInTheDocument()
  expect(screen.queryByRole('button', { name: 'Import' })).not.toBeInTheDocument()
})

test('an arena is deleted after a question, and a refusal is told', async () => {
  const server = start({
    [`DELETE /api/arenas/imported/${HASH}`]: refusal(409, '1 training uses this arena'),
  })
  const { user } = open('/arenas')
  await user.click((await card('Lab')).getByRole('button', { name: 'Delete Lab' }))
  await user.click(await screen.findByRole('button', { name: 'Delete' }))
  expect(await screen.findByText('1 training uses this arena')).toBeInTheDocument()
  expect(server.changes.at(-1)?.route).toBe(`DELETE /api/arenas/imported/${HASH}`)
})

test('an arena joins a suite of that name, or begins one', async () => {
  const old = { id: 's1', name: 'Doors', created_at: 1, scenarios: [] }
  const begun = { ...old, id: 's2', name: 'Corners' }
  const scenario = { sha256: HASH, name: 'Lab' }
  const server = start({
    'GET /api/suites': [old],
    'POST /api/suites': begun,
    'POST /api/suites/s1/scenarios': refusal(409, 'Lab has no start: draw one first.'),
    'POST /api/suites/s2/scenarios': { ...begun, scenarios: [scenario] },
  })
  const { user } = open('/arenas')
  await user.click((await card('Lab')).getByRole('button', { name: 'Add Lab to a suite' }))
  const dialog = within(await screen.findByRole('dialog'))
  const name = dialog.getByRole('combobox', { name: 'Suite of your own' })
  await user.type(name, 'Doors')
  await user.click(dialog.getByRole('button', { name: 'Add' }))
  expect(await dialog.findByText('Lab has no start: draw one first.')).toBeInTheDocument()

  await user.clear(name)
  await user.type(name, 'Corners')
  await user.click(dialog.getByRole('button', { name: 'Add' }))
  expect(await dialog.findByText('Corners has 1 scenario now.')).toBeInTheDocument()
  expect(dialog.getByRole('link', { name: 'Evaluate on the suite' })).toHaveAttribute(
    'href',
    expect.stringContaining('s2'),
  )
  expect(server.changes.map(({ route, body }) => [route, body])).toEqual([
    ['POST /api/suites/s1/scenarios', { sha256: HASH }],
    ['POST /api/suites', { name: 'Corners' }],
    ['POST /api/suites/s2/scenarios', { sha256: HASH }],
  ])
})

test('facts are short', () => {
  expect(arenaFacts({ ...LAB, obstacles: 0 })).toBe(
    '8\u00a0×\u00a06\u00a0m\u00a0· no\u00a0obstacles\u00a0· 82\u00a0%\u00a0free',
  )
})
