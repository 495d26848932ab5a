import { screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import type { Reproduction } from '../api/types'
import { curves, reproduction } from '../testing/examples'
import { open } from '../testing/render'
import { FakeEventSource, refusal, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const ROUTE = 'GET /api/reproduction'
const routes = { [ROUTE]: reproduction, 'GET /api/compare/curves': curves }
const none: Reproduction = {
  ...reproduction,
  campaign: null,
  campaigns: [],
  rows: reproduction.rows.map((row) => ({ ...row, ours: null, experiment_id: null, runs: [] })),
}
const ended = (state: 'completed' | 'stopped', over: object = {}): Reproduction => ({
  ...reproduction,
  campaign: { ...(reproduction.campaign as NonNullable<Reproduction['campaign']>), state, ...over },
  rows: reproduction.rows.map((row) => ({
    ...row,
    runs: row.runs.map((run) => ({ ...run, state, error: null })),
  })),
})

test('before the first campaign one button launches all of it, and says what it will take', async () => {
  const server = startServer({
    [ROUTE]: none,
    'POST /api/reproduction': () => {
      server.routes[ROUTE] = reproduction
      return Response.json(reproduction, { status: 201 })
    },
  })
  const { user } = open('/reproduction')
  const invitation = await screen.findByTestId('invitation')
  expect(invitation).toHaveTextContent('15 trainings, about 16 min with 2 workers')
  expect(screen.getByTestId('paper-table')).toHaveTextContent(/67\.8\s%/)
  await user.click(screen.getByRole('button', { name: 'Reproduce the paper' }))
  expect(server.changes).toEqual([{ route: 'POST /api/reproduction', body: { seeds: 5, effort: 1 } }])
  expect(await screen.findByTestId('campaign')).toHaveTextContent('Running')
})

test('while it goes on: progress, time left, each seed, and what has failed', async () => {
  startServer(routes)
  const { user } = open('/reproduction')
  const campaign = await screen.findByTestId('campaign')
  expect(campaign).toHaveTextContent(/1 of 4 trainings done/)
  expect(campaign).toHaveTextContent(/43\.0\s%, about 6 min 40 s left/)
  expect(screen.getByRole('progressbar', { name: 'Progress of the campaign' })).toHaveAttribute(
    'aria-valuenow',
    '43',
  )
  const [ddpg, , resblock] = screen.getAllByTestId('seeds')
  await user.click(within(resblock as HTMLElement).getByText('1 seed'))
  expect(within(resblock as HTMLElement).getByRole('link', { name: /Seed 0: 83\.0\s%/ })).toHaveAttribute(
    'href',
    '/runs/run1',
  )
  expect(within(resblock as HTMLElement).getByRole('link', { name: /Seed 1: Running, 55\.0/ })).toBeVisible()
  expect(within(ddpg as HTMLElement).getByRole('link', { name: 'Seed 0: Failed' })).toBeVisible()
  expect(screen.getByTestId('failed')).toHaveTextContent('DDPG, seed 0: out of memory')
  expect(screen.queryByRole('button', { name: /Reproduce/ })).toBeNull()
})

test('paper and ours stand side by side, with intervals', async () => {
  startServer(routes)
  open('/reproduction')
  await screen.findByTestId('paper-table')
  const [, paper] = screen.getAllByTestId('paper-row')
  const [notYet, ours] = screen.getAllByTestId('our-row')
  expect(paper).toHaveTextContent(/ResBlock PPO\s*paper\s*9\.07\s*87\s*67\.8\s%\s*114\.9/)
  expect(ours).toHaveTextContent(/ours, 1 seed\s*14\.20\s*14\.19 to 14\.21/)
  expect(ours).toHaveTextContent(/83\.0\s%\s*82\.0\s% to 84\.0\s%/)
  expect(notYet).toHaveTextContent(/^ours–+$/)
  expect(paper).toHaveTextContent('None of 2 seeds failed: up to 78 % may (one-sided 95 %).')
  expect(screen.getByRole('link', { name: 'ResBlock PPO' })).toHaveAttribute('href', '/experiments/exp1')
})

test('a sentence for each claim, with its word, its figures and the paper’s own', async () => {
  startServer(routes)
  open('/reproduction')
  const [holds, open_] = await screen.findAllByTestId('claim')
  expect(holds).toHaveAttribute('data-word', 'holds')
  expect(holds).toHaveTextContent('9.6 points more, 95 % interval [+6.6, +12.6]')
  expect(holds).toHaveTextContent('59 of 63 against 59 of 87')
  expect(holds).toHaveTextContent('The paper’s effect, +25.8 points, lies inside our interval: compatible.')
  expect(open_).toHaveTextContent("can't be told")
  expect(within(open_ as HTMLElement).queryByTestId('other-way')).toBeNull()
  expect(screen.getByTestId('told')).toHaveTextContent("1 hold · 0 do not hold · 1 can't be told")
})

test('what is said of DDPG stands a second time with its logit penalty', async () => {
  startServer(routes)
  open('/reproduction')
  const other = await screen.findByTestId('other-way-row')
  expect(other).toHaveTextContent(/^DDPG, logit penaltyours–+/)
  const again = screen.getByTestId('other-way')
  expect(again).toHaveAttribute('data-word', "can't be told")
  expect(again).toHaveTextContent("With DDPG's logit penalty: can't be told")
  expect(again).toHaveTextContent('2.1 points more, 95 % interval [-1.0, +5.2]')
})

test('the curves are those of the campaign’s experiments, named by method', async () => {
  const server = startServer(routes)
  open('/reproduction')
  const figure = await screen.findByRole('figure', { name: 'Complex arena, basic reward' })
  expect(figure).toHaveTextContent('ResBlock PPO, 2 seeds')
  expect(figure).toHaveTextContent('DDPG, 1 seed')
  expect(server.asked).toContain(
    '/api/compare/curves?experiment=exp2&experiment=exp1&name=train%2Freturn&points=150',
  )
})

test('everything is cancelled with one button, and goes on with one', async () => {
  const server = startServer({
    ...routes,
    'POST /api/reproduction/camp1/stop': () => {
      server.routes[ROUTE] = ended('stopped')
      return ended('stopped')
    },
    'POST /api/reproduction/camp1/resume': reproduction,
  })
  const { user } = open('/reproduction')
  await user.click(await screen.findByRole('button', { name: 'Cancel all' }))
  await user.click(await screen.findByRole('button', { name: 'Go on' }))
  expect(server.changes.map((change) => change.route)).toEqual([
    'POST /api/reproduction/camp1/stop',
    'POST /api/reproduction/camp1/resume',
  ])
})

test('rows with wide intervals get more seeds with one button', async () => {
  const wanted = { 'complex-resblock': 7, 'complex-ddpg': 7 }
  const server = startServer({
    ...routes,
    [ROUTE]: { ...ended('completed'), wanted },
    'POST /api/reproduction/camp1/seeds': () => {
      server.routes[ROUTE] = reproduction
      return Response.json(reproduction)
    },
  })
  const { user } = open('/reproduction')
  const more = await screen.findByRole('button', { name: 'More seeds' })
  await user.hover(more)
  expect(await screen.findByRole('tooltip')).toHaveTextContent('10 more trainings of 2 rows')
  await user.click(more)
  expect(server.changes.map((change) => change.route)).toEqual(['POST /api/reproduction/camp1/seeds'])
  await waitFor(() => expect(screen.queryByRole('button', { name: 'More seeds' })).toBeNull())
})

test('a campaign is deleted with everything in it, once that is confirmed', async () => {
  const server = startServer({
    ...routes,
    'DELETE /api/reproduction/camp1': () => {
      server.routes[ROUTE] = none
      return new Response(null, { status: 204 })
    },
  })
  const { user } = open('/reproduction?campaign=camp1')
  await user.click(await screen.findByRole('button', { name: 'Delete this campaign' }))
  const dialog = await screen.findByRole('dialog', { name: 'Delete this campaign?' })
  expect(dialog).toHaveTextContent('Its 4 trainings')
  expect(server.changes).toEqual([])
  await user.click(within(dialog).getByRole('button', { name: 'Delete' }))
  expect(await screen.findByTestId('invitation')).toBeInTheDocument()
  expect(server.changes.map((change) => change.route)).toEqual(['DELETE /api/reproduction/camp1'])
})

test('a second launch that the server refuses is explained', async () => {
  startServer({
    ...routes,
    [ROUTE]: ended('completed'),
    'POST /api/reproduction': refusal(
      409,
      'A campaign is not finished yet: wait for it, or cancel it first.',
    ),
  })
  const { user } = open('/reproduction')
  await user.click(await screen.findByRole('button', { name: 'Reproduce again' }))
  expect(await screen.findByText(/A campaign is not finished yet/)).toBeVisible()
})

test('a trial says that its figures mean nothing; earlier campaigns can be looked at', async () => {
  const trial = {
    ...ended('completed', { effort: 0.01 }),
    campaigns: [
      { id: 'camp1', created_at: 1 },
      { id: 'camp0', created_at: 0 },
    ],
  }
  const server = startServer({ ...routes, [ROUTE]: trial })
  const { user, router } = open('/reproduction')
  expect(await screen.findByTestId('trial')).toHaveTextContent(/1\.0\s% of the steps/)
  expect(screen.getByRole('button', { name: 'Reproduce the paper' })).toBeVisible()
  await user.click(screen.getByRole('combobox', { name: 'Campaign' }))
  await user.click(await screen.findByRole('option', { name: /Earlier/ }))
  await waitFor(() => expect(router.state.location.search).toBe('?campaign=camp0'))
  expect(server.asked).toContain('/api/reproduction?campaign=camp0')
})

test('a campaign that is not there', async () => {
  startServer({ [ROUTE]: refusal(404, 'There is no campaign nothing.') })
  open('/reproduction?campaign=nothing')
  expect(await screen.findByText('There is no such reproduction')).toBeVisible()
})
