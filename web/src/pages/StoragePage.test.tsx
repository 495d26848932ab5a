import { screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import { open } from '../testing/render'
import { FakeEventSource, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const all = { last: null, every: null, best: true }
const large = {
  id: 'e1',
  name: 'Corridor',
  in_trash: false,
  checkpoints: 40,
  checkpoint_bytes: 4e9,
  curve_bytes: 2e6,
  going: 0,
  going_bytes: 0,
  rule: all,
  own_rule: false,
  curve_rule: { points: null, after_days: 30 },
  own_curve_rule: false,
}
const small = { ...large, id: 'e2', name: 'Old one', in_trash: true, checkpoint_bytes: 1e6 }
const storage = {
  items: [large, small],
  total: 2,
  checkpoint_bytes: 4.001e9,
  going_bytes: 0,
  free_bytes: 5e8,
  min_free_bytes: 1e9,
  keep_days: 7,
}
const taken = {
  rule: { last: 3, every: 10, best: true },
  going: 30,
  going_bytes: 3e9,
  staying: 10,
  spared: [{ id: 'c1', seed: 0, step: 4096, reason: 'a training began with it' }],
  spared_total: 1,
}
const THINNING = '/api/experiments/e1/thinning'

test('the largest comes first; what a rule takes and leaves is said before it is applied', async () => {
  const server = startServer({
    'GET /api/storage': storage,
    [`GET ${THINNING}`]: taken,
    [`PUT ${THINNING}`]: taken,
  })
  const { user } = open('/storage')
  const [first, second] = await screen.findAllByTestId('stored')
  expect(first).toHaveTextContent('Corridor')
  expect(first).toHaveTextContent('4 GB')
  expect(second).toHaveTextContent('In the trash')
  expect(screen.getByRole('alert')).toHaveTextContent('The disk is nearly full')

  await user.click(screen.getByRole('button', { name: 'Clean up Corridor' }))
  const dialog = await screen.findByRole('dialog')
  expect(await within(dialog).findByText('30 checkpoints of 3 GB go by this rule.')).toBeInTheDocument()
  expect(within(dialog).getByText(/^seed 0, step 4.096: a training began with it$/)).toBeInTheDocument()
  expect(server.asked).toContain(`${THINNING}?best=true&last=3&every=10`)
  expect(server.changes).toEqual([])
  expect(within(dialog).queryByRole('button', { name: /now$/ })).toBeNull()

  await user.click(within(dialog).getByRole('button', { name: 'Apply' }))
  expect(server.changes).toEqual([{ route: `PUT ${THINNING}`, body: { rule: taken.rule } }])
})

test('what goes is freed at once, or kept after all', async () => {
  const going = { ...large, rule: taken.rule, own_rule: true, going: 30, going_bytes: 3e9 }
  const server = startServer({
    'GET /api/storage': { ...storage, items: [going], going_bytes: 3e9 },
    [`GET ${THINNING}`]: { ...taken, going: 0, going_bytes: 0, spared: [], spared_total: 0 },
    [`PUT ${THINNING}`]: taken,
    [`POST ${THINNING}/free`]: taken,
  })
  const { user } = open('/storage')
  expect(await screen.findByText('Of each run the newest 3, one in 10, the best')).toBeInTheDocument()
  await user.click(screen.getByRole('button', { name: 'Clean up Corridor' }))
  const dialog = await screen.findByRole('dialog')
  await user.click(within(dialog).getByText('All stay'))
  expect(await within(dialog).findByText('Nothing goes by this rule.')).toBeInTheDocument()
  await user.click(within(dialog).getByRole('button', { name: 'Apply' }))
  await user.click(await screen.findByRole('button', { name: 'Clean up Corridor' }))
  await user.click(await screen.findByRole('button', { name: 'Free 3 GB now' }))
  expect(server.changes).toEqual([
    { route: `PUT ${THINNING}`, body: { rule: all } },
    { route: `POST ${THINNING}/free`, body: null },
  ])
})

const CURVES = '/api/experiments/e1/curve-thinning'
const nothing = {
  rule: { points: null, after_days: 30 },
  runs: 0,
  points: 0,
  kept: 0,
  frees: 0,
  later: 3,
  marked: 0,
  thins_at: null,
  spared: null,
}

test('curves stay as they are until a rule is given, which says before what it frees', async () => {
  const rule = { points: 1000, after_days: 30 }
  const found = { ...nothing, rule, runs: 2, points: 4_300_000, kept: 86_000, frees: 21e6 }
  const server = startServer({
    'GET /api/storage': storage,
    [`GET ${THINNING}`]: taken,
    [`GET ${CURVES}`]: found,
    [`PUT ${CURVES}`]: found,
  })
  const { user } = open('/storage')
  await user.click(await screen.findByRole('button', { name: 'Clean up Corridor' }))
  await user.click(await screen.findByRole('tab', { name: 'Curves' }))
  expect(await screen.findByText('Every point stays.')).toBeInTheDocument()
  expect(server.asked).toContain(`${CURVES}?after_days=30`)
  await user.click(screen.getByText('Long ago, fewer'))
  expect(
    await screen.findByText(/^4.300.000 points of 2 runs become 86.000, which frees about 21 MB\.$/),
  ).toBeInTheDocument()
  expect(screen.getByText(/3 runs may follow/)).toBeInTheDocument()
  expect(screen.queryByRole('button', { name: /^Thin/ })).toBeNull()
  await waitFor(() => expect(server.asked).toContain(`${CURVES}?after_days=30&points=1000`))
  await user.click(screen.getByRole('button', { name: 'Apply' }))
  expect(server.changes).toEqual([{ route: `PUT ${CURVES}`, body: { rule } }])
})

test('what a rule thins is thinned at once, or left; a starred training is spared', async () => {
  const rule = { points: 500, after_days: 1 }
  const going = { ...large, curve_rule: rule, own_curve_rule: true }
  const marked = { ...nothing, rule, spared: 'it is starred', marked: 2, thins_at: 1.8e9 }
  const server = startServer({
    'GET /api/storage': { ...storage, items: [going] },
    [`GET ${THINNING}`]: taken,
    [`GET ${CURVES}`]: marked,
    [`PUT ${CURVES}`]: nothing,
    [`POST ${CURVES}/now`]: nothing,
  })
  const { user } = open('/storage')
  expect(await screen.findByText("Curves: 500 points a metric 1 day after a run's end")).toBeInTheDocument()
  await user.click(screen.getByRole('button', { name: 'Clean up Corridor' }))
  await user.click(await screen.findByRole('tab', { name: 'Curves' }))
  expect(await screen.findByText('No curve is thinned: it is starred.')).toBeInTheDocument()
  await user.click(screen.getByRole('button', { name: 'Thin 2 runs now' }))
  await user.click(await screen.findByRole('button', { name: 'Clean up Corridor' }))
  await user.click(await screen.findByRole('tab', { name: 'Curves' }))
  await user.click(await screen.findByRole('button', { name: "The installation's rule" }))
  expect(server.changes).toEqual([
    { route: `POST ${CURVES}/now`, body: null },
    { route: `PUT ${CURVES}`, body: { rule: null } },
  ])
})
