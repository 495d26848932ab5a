import { screen, waitFor, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import { frameHtml } from './frame'
import { HEADS } from './heads'
import { ROUTES } from './routes'
import { open } from './testing/render'
import { FakeEventSource, startServer } from './testing/server'

const linksOf = (nav: HTMLElement) =>
  within(nav)
    .getAllByRole('link')
    .map((link) => [link.textContent, link.getAttribute('href'), link.getAttribute('aria-current')])

test.each(Object.entries(HEADS))(
  'the head of %s in the HTML is the one that the application draws',
  async (name, head) => {
    vi.stubGlobal('EventSource', FakeEventSource)
    startServer({})
    const [path = '/'] = Object.entries(ROUTES).find(([, page]) => page === name) ?? []
    const address = path === '*' ? '/nowhere' : path
    const written = document.createElement('div')
    written.innerHTML = frameHtml(address, head)
    open(address)
    const title = await screen.findByRole('heading', { level: 1, name: head.title })
    const shown = (head: Element | null | undefined) =>
      [...(head?.parentElement?.querySelectorAll('h1, p.frame-about') ?? [])].map(
        ({ outerHTML }) => outerHTML,
      )
    await waitFor(() => expect(shown(title)).not.toEqual([]))
    // React Router says more of a link than where it leads.
    expect(shown(title).map(plain)).toEqual(shown(written.querySelector('h1')).map(plain))
  },
)

const plain = (html: string) => html.replace(/ data-discover="[^"]*"/g, '')

test('the header of the HTML is the one that the application draws', async () => {
  vi.stubGlobal('EventSource', FakeEventSource)
  startServer({ 'GET /api/experiments': { items: [], total: 0 } })
  const written = document.createElement('div')
  written.innerHTML = frameHtml('/policies')
  open('/policies')
  const drawn = await screen.findByRole('navigation', { name: 'Main' })
  await waitFor(() => expect(linksOf(within(written).getByRole('navigation'))).toEqual(linksOf(drawn)))
})
