import { screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import { frameHtml } from './frame'
import { open } from './testing/render'
import { FakeEventSource, startServer } from './testing/server'

const linksOf = (nav: HTMLElement) =>
  within(nav)
    .getAllByRole('link')
    .map((link) => [link.textContent, link.getAttribute('href'), link.getAttribute('aria-current')])

test('the header of the HTML is the one that the application draws', async () => {
  vi.stubGlobal('EventSource', FakeEventSource)
  startServer({ 'GET /api/experiments': { items: [], total: 0 } })
  const written = document.createElement('div')
  written.innerHTML = frameHtml('/policies')
  open('/policies')
  const drawn = await screen.findByRole('navigation', { name: 'Main' })
  await waitFor(() => expect(linksOf(within(written).getByRole('navigation'))).toEqual(linksOf(drawn)))
})
