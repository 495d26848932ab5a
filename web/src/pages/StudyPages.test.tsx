import { screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import type { Study } from '../api/types'
import { form, training } from '../testing/examples'
import { open } from '../testing/render'
import { FakeEventSource, refusal, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const path = 'algorithm.learning_rate'
const trial = (number: number, over: Partial<Study['results'][number]> = {}): Study['results'][number] => ({
  number,
  state: 'complete',
  values: { [path]: number / 1000 },
  experiment_id: `exp${number}`,
  progress: 1,
  success: 0.5 + number / 10,
  seconds_to_target: 16,
  cost: 180,
  rungs: {},
  reason: null,
  ...over,
})
const study: Study = {
  id: 'st1',
  project_id: 'default',
  name: 'Step sizes',
  created_at: 0,
  finished_at: null,
  state: 'running',
  sampler: 'tpe',
  trials: 5,
  asked: 4,
  complete: 2,
  pruned: 1,
  failed: 0,
  best_success: 0.7,
  spec: {
    training: training as unknown as Study['spec']['training'],
    settings: [{ kind: 'range', path, low: 0.0001, high: 0.01, log: true, points: 5 }],
    sampler: 'tpe',
    seeds: [0, 1, 2],
    at_once: 2,
    stop_early: true,
    seed: 0,
  },
  rule: 'A trial is stopped early once it does worse than the median.',
  progress: 0.7,
  seconds_left: 600,
  results: [
    trial(1),
    trial(2),
    trial(3, { state: 'pruned', success: null, reason: 'After evaluation 2 it did worse.' }),
    trial(4, { state: 'running', success: null, cost: null, progress: 0.5 }),
  ],
  best: 2,
  front: [2],
  importances: null,
  importance_intervals: null,
  judgement: null,
}
const routes = { 'GET /api/studies/st1': study, 'GET /api/training/form': form }

test('a study shows its trials, what is left, and the rule by which trials are stopped', async () => {
  const server = startServer({ ...routes, 'POST /api/studies/st1/stop': { ...study, state: 'stopped' } })
  const { user } = open('/studies/st1')
  expect(
    await screen.findByText(/3 of 5 trials through: 2 complete, 1 stopped early, 0 failed/),
  ).toBeVisible()
  expect(screen.getByText('about 10 min left')).toBeVisible()
  expect(screen.getByText(/worse than the median/)).toBeVisible()
  expect(screen.getByText(/Best by its tuning seeds: trial 2 with 70\.0\s%/)).toBeVisible()
  const [newest, stopped, best] = screen.getAllByTestId('trial')
  expect(within(newest as HTMLElement).getByRole('progressbar')).toHaveAttribute('aria-valuenow', '50')
  expect(stopped).toHaveTextContent(/Stopped early.*After evaluation 2/)
  expect(best).toHaveTextContent(/Trial 2Best.*0\.002.*70\.0\s%.*16 s.*3 min/)
  expect(within(best as HTMLElement).getByRole('link')).toHaveAttribute('href', '/experiments/exp2')
  expect(screen.getByRole('link', { name: 'Train the best' })).toHaveAttribute('href', '/new?from=exp2')
  await user.click(screen.getByRole('button', { name: 'Stop' }))
  await waitFor(() => expect(server.changes[0]?.route).toBe('POST /api/studies/st1/stop'))
})

test('its charts hold the complete trials alone, and importances once they are known', async () => {
  startServer({
    ...routes,
    'GET /api/studies/st1': {
      ...study,
      importances: { [path]: 1 },
      importance_intervals: {
        unit: 'trials',
        trials: 34,
        resamples: 200,
        spans: { [path]: { low: 0.62, high: 1 } },
        told: '95 % intervals over trials, by 200 bootstrap samples of the 34 complete ones.',
      },
    },
  })
  open('/studies/st1')
  const history = await screen.findByRole('img', { name: /^Success of each trial/ })
  expect(history.querySelectorAll('circle')).toHaveLength(2)
  expect(history.querySelector('circle:last-of-type title')?.textContent).toMatch(
    /^Trial 2: 70\.0\s%\nLearning rate 0\.002/,
  )
  const slices = screen.getByRole('img', { name: 'Success by Learning rate' })
  // A tenth of the way between powers of ten is no tenth of the way on the page.
  const [first, second] = [...slices.querySelectorAll('circle')].map((one) => Number(one.getAttribute('cx')))
  expect(((second ?? 0) - (first ?? 0)) / 366).toBeCloseTo(Math.log10(2) / 2, 2)
  expect(screen.getByTestId('parallel').querySelectorAll('polyline')).toHaveLength(2)
  const importance = screen.getByRole('table', { name: 'Importance of each setting' })
  expect(importance).toHaveTextContent(/Learning rate100 %62\.0\s% to 100 %/)
  expect(screen.getByText(/intervals over trials, by 200 bootstrap samples of the 34/)).toBeVisible()
})

test('of few trials it is said that how sure importances are can not be told', async () => {
  const told = "How sure that is can't be told from 12 complete trials."
  const none = { unit: 'trials' as const, trials: 12, resamples: 200, spans: {}, told }
  startServer({
    ...routes,
    'GET /api/studies/st1': { ...study, importances: { [path]: 1 }, importance_intervals: none },
  })
  open('/studies/st1')
  expect(await screen.findByText(/can't be told from 12/)).toBeVisible()
  expect(screen.getByRole('table', { name: 'Importance of each setting' })).toHaveTextContent('100 %–')
})

test('one that is done says what its best is worth on fresh seeds, and can go on', async () => {
  const success = {
    value: 0.6,
    low: 0.4,
    high: 0.8,
    unit: 'seeds' as const,
    seeds: 5,
    episodes: 1000,
    failed: null,
  }
  const done: Study = {
    ...study,
    state: 'done',
    judgement: {
      trial: 2,
      experiment_id: 'judge',
      seeds: [3, 4, 5, 6, 7],
      state: 'completed',
      success: { ...success, per_seed: [0.6, 0.6, 0.6, 0.6, 0.6] },
    },
  }
  const server = startServer({
    ...routes,
    'GET /api/studies/st1': done,
    'POST /api/studies/st1/extend': refusal(409, 'It has as many as there may be.'),
  })
  const { user } = open('/studies/st1')
  expect(await screen.findByTestId('judgement')).toHaveTextContent(
    /5 seeds that the search never saw: trial 2 60\.0\s%/,
  )
  await user.click(screen.getByRole('button', { name: '10 more trials' }))
  expect(await screen.findByText('It has as many as there may be.')).toBeVisible()
  expect(server.changes[0]?.body).toEqual({ trials: 10 })
})

test('the list of studies', async () => {
  startServer({ 'GET /api/studies': { items: [study], total: 1 } })
  open('/studies')
  const row = await screen.findByTestId('study')
  expect(row).toHaveTextContent(/Step sizes.*Searching.*3 of 5.*70\.0\s%.*TPE/)
  expect(within(row).getByRole('link')).toHaveAttribute('href', '/studies/st1')
})

test('before the first study it is said how to launch one', async () => {
  startServer({ 'GET /api/studies': { items: [], total: 0 } })
  open('/studies')
  expect(await screen.findByText(/give a number a range/)).toBeVisible()
})

test('a range in the form makes a study of the training, refused at its field', async () => {
  const detail = [{ loc: ['body', 'training', 'steps'], msg: 'this is refused', type: 'refused' }]
  const server = startServer({ 'GET /api/training/form': form, 'POST /api/studies': refusal(422, detail) })
  const { user } = open('/new')
  await user.click(await screen.findByRole('button', { name: 'Try a range: Steps' }))
  const high = screen.getByRole('textbox', { name: 'Steps, to' })
  await user.clear(high)
  await user.type(high, '400000')
  expect(screen.getByRole('group', { name: 'Study' })).toHaveTextContent('1 setting searched')
  expect(screen.getByTestId('launch-summary')).toHaveTextContent(/At most 90 runs/)
  await user.click(screen.getByRole('button', { name: 'Launch the study' }))
  expect((await screen.findAllByText(/This is refused/)).length).toBeGreaterThan(0)
  expect(server.changes[0]?.body).toMatchObject({
    seeds: [0, 1, 2],
    trials: 30,
    sampler: 'tpe',
    settings: [{ kind: 'range', path: 'steps', low: 150_000, high: 400_000, log: false }],
  })
  await user.click(screen.getByRole('button', { name: 'One value of Steps' }))
  expect(screen.getByRole('button', { name: 'Launch' })).toBeVisible()
})

test('settings of a reward and hidden layers are searched, a term where it stands by then', async () => {
  const server = startServer({
    'GET /api/training/form': form,
    'POST /api/studies': refusal(422, [
      {
        loc: ['body', 'training', 'task', 'reward', 'terms', '0', 'weight'],
        msg: 'that is refused',
        type: 'refused',
      },
    ]),
  })
  const { user } = open('/new')
  await user.click(await screen.findByRole('button', { name: /^Advanced/ }))
  await user.click(screen.getByRole('button', { name: 'Try a range: Progress, weight' }))
  await user.click(screen.getByRole('button', { name: 'Try several: Progress, exponential' }))
  await user.click(screen.getByRole('button', { name: 'Try several: Hidden layers' }))
  const second = screen.getByRole('textbox', { name: 'Hidden layers, choice 2' })
  expect(second).toHaveValue('128, 128')
  await user.clear(second)
  await user.type(second, '96, 2')
  expect(screen.getByText('Each must be 4 to 1 024.')).toBeVisible()
  await user.click(screen.getByRole('button', { name: 'Launch the study' }))
  expect(server.changes).toEqual([])
  await user.clear(second)
  await user.type(second, '96')
  await user.click(screen.getByRole('button', { name: 'Another choice of Hidden layers' }))
  await user.click(screen.getByRole('button', { name: 'Remove choice 4 of Hidden layers' }))
  // The first term goes: the second is the first now, and still the one that is searched.
  await user.click(screen.getByRole('button', { name: 'Remove Arrival' }))
  await user.click(screen.getByRole('button', { name: 'Launch the study' }))
  expect((await screen.findAllByText(/That is refused/)).length).toBeGreaterThan(1)
  expect(server.changes[0]?.body).toMatchObject({
    settings: [
      { kind: 'range', path: 'task.reward.terms.0.weight', low: 50, high: 5000, log: true },
      { kind: 'list', path: 'task.reward.terms.0.exponential', values: [true, false] },
      {
        kind: 'list',
        path: 'algorithm.network.hidden_sizes',
        values: [[64, 64], [96], [256, 256]],
      },
    ],
  })
})

test('a study of weights and layers names both in its charts and its table', async () => {
  const [weight, layers] = ['task.reward.terms.1.weight', 'algorithm.network.hidden_sizes']
  const both = (number: number, sizes: number[]) =>
    trial(number, { values: { [weight]: -50, [layers]: sizes } })
  startServer({
    ...routes,
    'GET /api/studies/st1': {
      ...study,
      spec: {
        ...study.spec,
        settings: [
          { kind: 'range', path: weight, low: -400, high: -25, log: true, points: 5 },
          {
            kind: 'list',
            path: layers,
            values: [
              [64, 64],
              [256, 256],
            ],
          },
        ],
      },
      results: [both(1, [64, 64]), both(2, [256, 256])],
    },
  })
  open('/studies/st1')
  const table = await screen.findByRole('table', { name: 'Trials' })
  expect(within(table).getByRole('columnheader', { name: 'Progress, weight' })).toBeVisible()
  expect(screen.getAllByTestId('trial')[0]).toHaveTextContent(/−50256, 256/)
  const layersChart = screen.getByRole('img', { name: 'Success by Hidden layers' })
  const [first, other] = [...layersChart.querySelectorAll('circle')].map((one) =>
    Number(one.getAttribute('cx')),
  )
  expect(other).toBeGreaterThan(first ?? 0)
  const weights = screen.getByRole('img', { name: 'Success by Progress, weight' })
  expect(weights).toHaveTextContent('−100')
})
