import { fireEvent, screen, waitFor } from '@testing-library/react'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import type { ArenaGeometry } from '../api/types'
import { arenaFromSearch, drawOn } from '../lib/arenas'
import { open } from '../testing/render'
import { FakeEventSource, refusal, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

/** Pixels of a metre; the middle of the arena is at 500, 500. */
const SCALE = 50
const MIDDLE = 500

const HASH = 'b'.repeat(64)
const movers = { count: 0, kind: 'pedestrian', speed: 1, radius: 0.25, sees_robots: false } as const
const CONFIG = { name: 'imported', sha256: HASH, arena: null, movers } as const
const WELL = { free_area: 90, free_share: 0.9, remarks: [] }

beforeEach(() => {
  const matrix = { a: SCALE, d: SCALE, e: MIDDLE, f: MIDDLE } as DOMMatrix
  Object.assign(SVGElement.prototype, { getScreenCTM: () => matrix })
})
afterEach(() => {
  Reflect.deleteProperty(SVGElement.prototype, 'getScreenCTM')
})

function start(routes = {}) {
  return startServer({ 'POST /api/arenas/reviews': WELL, ...routes })
}

async function draw(address = '/arenas/draw') {
  const page = open(address)
  const drawing = await screen.findByTestId('drawing')
  const at = ([x, y]: readonly [number, number]) => ({
    button: 0,
    pointerId: 1,
    clientX: MIDDLE + SCALE * x,
    clientY: MIDDLE - SCALE * y,
  })
  const drag = (...places: readonly (readonly [number, number])[]) => {
    const [first = [0, 0], ...rest] = places
    fireEvent.pointerDown(drawing, at(first))
    for (const place of rest) fireEvent.pointerMove(drawing, at(place))
    fireEvent.pointerUp(drawing, at(places.at(-1) ?? first))
  }
  const tool = (name: string) => page.user.click(screen.getByRole('button', { name }))
  return { ...page, drag, tool, keys: () => screen.getByRole('application') }
}

/** What the page remembers of it. */
const drawn = (): ArenaGeometry => JSON.parse(localStorage.getItem('mapless-arena-draft') ?? 'null')

test('walls, boxes, discs, a door, a way, start and target are drawn with the pointer', async () => {
  start()
  const { drag, tool } = await draw()
  await tool('Wall')
  drag([-3.02, 1.01], [3.04, 0.98])
  await tool('Box')
  drag([1, -1], [2, -2])
  await tool('Disc')
  drag([-2, -2], [-2, -1.5])
  await tool('Door')
  drag([0, 1])
  await tool("Person's way")
  drag([-4, 3])
  drag([4, 3])
  drag([4, 3])
  await tool('Start')
  drag([-4, -4], [-4, -3])
  await tool('Target')
  drag([4, -4])
  expect(drawn()).toMatchObject({
    boxes: [
      { x: 1.5, y: -1.5, length: 1, width: 1 },
      { x: -1.775, y: 1, length: 2.55, width: 0.1, angle: 0 },
      { x: 1.775, y: 1, length: 2.55, width: 0.1, angle: 0 },
    ],
    circles: [{ x: -2, y: -2, radius: 0.5 }],
    movers: [
      {
        kind: 'pedestrian',
        waypoints: [
          { x: -4, y: 3 },
          { x: 4, y: 3 },
        ],
      },
    ],
    start: { x: -4, y: -4, heading: 90 },
    target: { x: 4, y: -4 },
  })
})

test('what is chosen is moved, sized and turned by its handles, and taken away', async () => {
  start()
  const { drag, tool, user, keys } = await draw()
  await tool('Box')
  drag([0, 0], [2, 1])
  await tool('Select')
  drag([1, 0.5], [1.3, 0.5], [2.02, 0.5])
  expect(drawn().boxes).toEqual([{ x: 2, y: 0.5, length: 2, width: 1, angle: 0 }])
  drag([3, 0.5], [4, 0.5])
  expect(drawn().boxes).toMatchObject([{ x: 2.5, length: 3 }])
  await user.clear(screen.getByRole('textbox', { name: 'Angle, °' }))
  await user.type(screen.getByRole('textbox', { name: 'Angle, °' }), '30')
  expect(drawn().boxes).toMatchObject([{ angle: 30 }])
  keys().focus()
  await user.keyboard('{Delete}')
  expect(drawn().boxes).toEqual([])
})

test('everything is undone and done again, a row of steps with a key at once', async () => {
  start()
  const { drag, tool, user, keys } = await draw()
  await tool('Disc')
  drag([1, 1])
  keys().focus()
  await user.keyboard('{ArrowRight}{ArrowRight}{Shift>}{ArrowUp}{/Shift}')
  expect(drawn().circles).toEqual([{ x: 1.5, y: 2.25, radius: 0.3 }])
  await user.keyboard('{Control>}z{/Control}')
  expect(drawn().circles).toEqual([{ x: 1, y: 1, radius: 0.3 }])
  await user.click(screen.getByRole('button', { name: 'Undo' }))
  expect(screen.getByRole('button', { name: 'Undo' })).toBeDisabled()
  await user.keyboard('{Control>}{Shift>}Z{/Shift}{/Control}')
  await user.click(screen.getByRole('button', { name: 'Redo' }))
  expect(drawn().circles).toEqual([{ x: 1.5, y: 2.25, radius: 0.3 }])
})

test('by keyboard alone: drawn in the middle, chosen one after another, turned, copied', async () => {
  start()
  const { tool, user, keys } = await draw()
  await tool('Wall')
  keys().focus()
  await user.keyboard('{Enter}{Escape}{Escape}n')
  expect(screen.getByRole('combobox', { name: 'Chosen' })).toHaveValue('Box 1')
  await user.keyboard('rr{Control>}d{/Control}')
  expect(drawn().boxes).toMatchObject([
    { x: 1, y: 0, angle: 30 },
    { x: 1.25, y: -0.25, angle: 30 },
  ])
})

test('without a grid things stand where they are put', async () => {
  start()
  const { drag, tool, user } = await draw()
  await user.click(screen.getByRole('combobox', { name: 'Grid' }))
  await user.click(await screen.findByRole('option', { name: 'No grid' }))
  await tool('Target')
  drag([1.11, 0.37])
  expect(drawn().target).toEqual({ x: 1.11, y: 0.37 })
})

test('a drawing survives leaving the page', async () => {
  start()
  const first = await draw()
  await first.tool('Disc')
  first.drag([1, 1])
  first.unmount()
  await draw()
  expect(screen.getByTestId('drawing').querySelectorAll('circle')).toHaveLength(1)
})

test('the server looks it over once it rests, and what it finds is listed and marked', async () => {
  const remarks = [{ refused: true, text: 'Mover 1 does not get past (0.00, 0.00).', x: 0, y: 0 }]
  const server = start({ 'POST /api/arenas/reviews': { free_area: 3, free_share: 0.03, remarks } })
  const { drag, tool, user } = await draw()
  await tool('Disc')
  drag([1, 1], [1, 1.5], [1, 2], [1, 2.5], [1, 3])
  await user.type(screen.getByRole('textbox', { name: 'Name' }), 'Drawn')
  expect(await screen.findByText(/does not get past/)).toBeInTheDocument()
  await waitFor(() => expect(screen.getByTestId('review')).toHaveAttribute('data-current', 'true'))
  expect(screen.getByTestId('drawing').querySelector('text')).toHaveTextContent('1')
  expect(screen.getByRole('button', { name: 'Save' })).toBeDisabled()
  // Not one for every move and every letter.
  expect(server.changes.length).toBeLessThan(4)
  expect(server.changes.at(-1)?.body).toMatchObject({ arena: { circles: [{ radius: 2 }] }, clearance: 0.2 })
})

test('what was found of an earlier drawing is not taken for what is drawn now', async () => {
  const remarks = [{ refused: true, text: 'Mover 1 does not get past (0.00, 0.00).', x: 0, y: 0 }]
  const refusing = { free_area: 3, free_share: 0.03, remarks }
  const answers: (() => void)[] = []
  const held = () => new Promise<object>((resolve) => answers.push(() => resolve(WELL)))
  const server = start({ 'POST /api/arenas/reviews': refusing })
  const { drag, tool } = await draw()
  await screen.findByText(/does not get past/)
  server.routes['POST /api/arenas/reviews'] = held
  await tool('Disc')
  drag([1, 1], [1, 3])
  await waitFor(() => expect(answers).toHaveLength(1))
  expect(screen.getByTestId('review')).toHaveAttribute('data-current', 'false')
  answers[0]?.()
  await screen.findByText(/All is well/)
  expect(screen.getByTestId('review')).toHaveAttribute('data-current', 'true')
})

test('it is saved as an arena of ours, and trained on', async () => {
  const server = start({ 'POST /api/arenas/imported': { title: 'Drawn', config: CONFIG } })
  const { drag, tool, user, router } = await draw()
  await tool('Disc')
  drag([1, 1])
  expect(screen.getByRole('button', { name: 'Train on it' })).toBeDisabled()
  await user.type(screen.getByRole('textbox', { name: 'Name' }), 'Drawn')
  await user.click(screen.getByRole('button', { name: 'Save' }))
  expect(await screen.findByText('Saved: “Drawn” is in the gallery.')).toBeInTheDocument()
  const kept = server.changes.filter(({ route }) => route === 'POST /api/arenas/imported')
  expect(kept).toHaveLength(1)
  const [{ body } = { body: null }] = kept
  const { files } = body as { files: { name: string; content: string }[] }
  expect(JSON.parse(atob(files[0]?.content ?? ''))).toMatchObject({
    name: 'Drawn',
    circles: [{ x: 1, y: 1 }],
  })
  await user.click(screen.getByRole('button', { name: 'Train on it' }))
  await waitFor(() => expect(router.state.location.pathname).toBe('/new'))
  const chosen = new URLSearchParams(router.state.location.search).get('arena')
  expect(arenaFromSearch(chosen)).toEqual(CONFIG)
  // What was saved already is not saved again.
  expect(server.changes.filter(({ route }) => route === 'POST /api/arenas/imported')).toHaveLength(1)
})

test('a refusal to save is told', async () => {
  start({ 'POST /api/arenas/imported': refusal(409, 'There are 1000 imported arenas already.') })
  const { user } = await draw()
  await user.type(screen.getByRole('textbox', { name: 'Name' }), 'One more')
  await user.click(screen.getByRole('button', { name: 'Evaluate on it' }))
  expect(await screen.findByText('There are 1000 imported arenas already.')).toBeInTheDocument()
})

test('one draws on a copy of any arena, and can take that back', async () => {
  const geometry = {
    format: 'mapless-arena/1',
    name: 'complex',
    width: 12,
    height: 10,
    circles: [{ x: 1, y: 0.5, radius: 0.3 }],
    boxes: [],
    movers: [],
    start: null,
    target: null,
  }
  start({ 'GET /api/arenas/fixed': { title: 'Complex', geometry } })
  const { router, user } = await draw(drawOn({ name: 'complex', movers }))
  await waitFor(() => expect(drawn()).toMatchObject({ name: 'Complex, changed', width: 12 }))
  await waitFor(() => expect(router.state.location.search).toBe(''))
  await user.click(screen.getByRole('button', { name: 'Undo' }))
  expect(screen.getByRole('textbox', { name: 'Width, m' })).toHaveValue('10')
})
