import { fireEvent, screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import { comparison, curves, form, listed, profiles } from '../testing/examples'
import { open } from '../testing/render'
import { FakeEventSource, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const ADDRESS = '/compare?experiment=exp1&experiment=exp2&panel=loss/value'
/** Of a plot, in a frame of 1,200 less its axis and its room to the right. */
const WIDTH = 1200 - 52 - 12

/** Opens a comparison whose curves go from step 0 over 100 to 200, and waits until its chart is drawn. */
async function drawn(address: string) {
  startServer({
    'GET /api/compare': comparison,
    'GET /api/compare/curves': { ...curves, name: 'loss/value' },
    'GET /api/compare/profiles': profiles,
    'GET /api/compare/metrics': { runs: 3, metrics: [{ name: 'loss/value', runs: 3 }] },
    'GET /api/training/form': form,
    'GET /api/experiments': { items: [listed], total: 1, next: null },
  })
  const opened = open(address)
  const chart = await screen.findByRole('figure', { name: 'Value loss' })
  await waitFor(() => expect(chart.querySelector('.u-over')).toBeInTheDocument())
  return { ...opened, chart }
}

/** The step that the chart says one points at, so far across its plot. */
async function pointed(chart: HTMLElement, across: number): Promise<string> {
  const plot = chart.querySelector('.u-over')
  if (!plot) throw new Error('nothing is drawn')
  fireEvent.mouseEnter(plot)
  fireEvent.mouseMove(plot, { clientX: across * WIDTH, clientY: 50 })
  const [text] = await within(chart).findAllByText(/^Steps \d/)
  return text?.textContent ?? ''
}

test('a chart shows of x what the address says, and all of it again', async () => {
  const { chart, router, user } = await drawn(`${ADDRESS}&zoom=100~180`)
  await waitFor(async () => expect(await pointed(chart, 0.5)).toBe('Steps 140'))
  expect(await pointed(chart, 0)).toBe('Steps 100')
  expect(await pointed(chart, 0.999)).toBe('Steps 180')
  await user.click(within(chart).getByRole('button', { name: 'Reset zoom' }))
  expect(router.state.location.search).not.toContain('zoom')
  await waitFor(async () => expect(await pointed(chart, 0.5)).toBe('Steps 100'))
})

test('without one it shows all of x', async () => {
  const { chart } = await drawn(ADDRESS)
  await waitFor(async () => expect(await pointed(chart, 0.5)).toBe('Steps 100'))
  expect(within(chart).queryByRole('button', { name: 'Reset zoom' })).not.toBeInTheDocument()
})

test('a chart whose lines change is drawn anew where it was zoomed to', async () => {
  const { chart, user } = await drawn(`${ADDRESS}&zoom=100~180`)
  await waitFor(async () => expect(await pointed(chart, 0.5)).toBe('Steps 140'))
  const before = chart.querySelector('.u-over')
  await user.click(within(chart).getByRole('button', { name: /^Alone/ }))
  await waitFor(() => expect(chart.querySelector('.u-over')).not.toBe(before))
  await waitFor(async () => expect(await pointed(chart, 0.5)).toBe('Steps 140'))
})

test('the report is of what the page shows', async () => {
  await drawn(`${ADDRESS}&zoom=100~180&hide=exp2&smooth=0.8~loss/value&smooth=0.5~train/return`)
  // The return is not among the panels.
  expect(screen.getByRole('link', { name: 'Report (HTML)' })).toHaveAttribute(
    'href',
    '/api/compare/report?experiment=exp1&experiment=exp2&margin=0.02&name=loss%2Fvalue&smooth=0.8%7Eloss%2Fvalue&hide=exp2&zoom=100%7E180',
  )
})
