import { fireEvent, screen, waitFor } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import type { Playground } from '../api/types'
import { open } from '../testing/render'
import { FakeEventSource, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const ground: Playground = {
  id: 'pg1',
  policy: 'Simple arena',
  driving: true,
  problem: null,
  sim_time: 1,
  robot: { x: 0, y: 0, heading: 0, radius: 0.2 },
  target: { x: 1, y: 1, heading: 0, radius: 0 },
  movers: [],
  geometry: {
    format: 'mapless-arena/1',
    name: 'Simple',
    width: 4,
    height: 4,
    circles: [],
    boxes: [],
    movers: [],
    start: null,
    target: null,
  },
  chosen: { act: 'choose', thing: null, index: 0 },
  settings: {
    paused: true,
    speed: 1,
    noise: 0,
    dropout: 0,
    delay: 0,
    blind_width: 0,
    blind_direction: 0,
    rays: true,
    field: false,
    follow: false,
  },
  reward: 0,
  arrivals: 0,
  collisions: 0,
  timeouts: 0,
  outcome: null,
  seconds: null,
  value: null,
  outdated: false,
}

test('presses of a key go on from one another, whatever a look between them says of the service', async () => {
  const held: (() => void)[] = []
  let settings = ground.settings
  const server = startServer({
    'GET /api/playgrounds/pg1': () => ({ ...ground, settings }),
    // A busy service: an answer comes when the test lets it.
    'PUT /api/playgrounds/pg1/settings': async (request: Request) => {
      const wanted = await request.json()
      await new Promise<void>((resolve) => held.push(resolve))
      settings = wanted
      return { ...ground, settings }
    },
  })
  open('/playground/pg1')
  const slider = await screen.findByRole('slider', { name: 'Blind sector' })
  const looks = () => server.asked.filter((asked) => asked === '/api/playgrounds/pg1').length
  const press = async () => {
    fireEvent.keyDown(slider, { key: 'ArrowRight' })
    const before = looks()
    await waitFor(() => expect(looks()).toBeGreaterThan(before + 1), { timeout: 5_000 })
  }
  const shown: (string | null)[] = []
  const observer = new MutationObserver(() => shown.push(slider.getAttribute('aria-valuenow')))
  observer.observe(slider, { attributes: true, attributeFilter: ['aria-valuenow'] })
  slider.focus()
  await press()
  await press()
  await press()
  expect(slider).toHaveAttribute('aria-valuenow', '15')
  const before = looks()
  // One after another they are said, the last of them last.
  await waitFor(
    () => {
      held.splice(0).map((answer) => answer())
      expect(settings.blind_width).toBe(15)
    },
    { timeout: 5_000 },
  )
  await waitFor(() => expect(looks()).toBeGreaterThan(before + 1), { timeout: 5_000 })
  // It never goes back, not even between the answer and what is shown of it.
  expect(shown).toEqual(['5', '10', '15'])
  observer.disconnect()
  expect(server.changes.map(({ body }) => (body as Playground['settings']).blind_width)).toEqual([5, 10, 15])
}, 30_000)
