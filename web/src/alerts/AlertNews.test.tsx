import { QueryClientProvider } from '@tanstack/react-query'
import { act, render } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import { createQueryClient } from '../api/client'
import { startServer } from '../testing/server'
import { AlertNews } from './AlertNews'

const later = <Value,>(ms: number, value: () => Value) =>
  new Promise<Value>((come) => setTimeout(() => come(value()), ms))

test('when the newest alert is deleted, what is asked for goes back once, and stays there', async () => {
  window.localStorage.setItem('mapless.alerts.shown', '0')
  let newest = 1
  const server = startServer({
    'GET /api/alerts/news': () => later(20, () => ({ newest, items: [] })),
  })
  const kept = vi.spyOn(Storage.prototype, 'setItem')
  const values = () => kept.mock.calls.map(([, value]) => value)
  const client = createQueryClient()
  render(
    <QueryClientProvider client={client}>
      <AlertNews />
    </QueryClientProvider>,
  )
  await vi.waitFor(() => expect(values()).toEqual(['1']))
  await vi.waitFor(() => expect(server.asked.at(-1)).toContain('after=1'))

  newest = 0
  await act(() => client.invalidateQueries())
  await vi.waitFor(() => expect(server.asked.at(-1)).toContain('after=0'))
  await act(() => later(300, () => {}))
  expect(values()).toEqual(['1', '0'])
})
