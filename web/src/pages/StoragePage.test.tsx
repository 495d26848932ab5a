import { screen, within } from '@testing-library/react'
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

  await user.click(screen.getByRole('button', { name: 'Rule of Corridor' }))
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
  await user.click(screen.getByRole('button', { name: 'Rule of Corridor' }))
  const dialog = await screen.findByRole('dialog')
  await user.click(within(dialog).getByText('All stay'))
  expect(await within(dialog).findByText('Nothing goes by this rule.')).toBeInTheDocument()
  await user.click(within(dialog).getByRole('button', { name: 'Apply' }))
  await user.click(await screen.findByRole('button', { name: 'Rule of Corridor' }))
  await user.click(await screen.findByRole('button', { name: 'Free 3 GB now' }))
  expect(server.changes).toEqual([
    { route: `PUT ${THINNING}`, body: { rule: all } },
    { route: `POST ${THINNING}/free`, body: null },
  ])
})
