import { keepPreviousData, QueryClient, QueryClientProvider, queryOptions } from '@tanstack/react-query'
import { act, render, screen } from '@testing-library/react'
import { type ReactNode, StrictMode, useLayoutEffect } from 'react'
import { createRoot } from 'react-dom/client'
import { expect, test, vi } from 'vitest'
import { useInSlices } from './useInSlices'

const letter = (key: string, answer: () => string | Promise<string>) =>
  queryOptions({ queryKey: [key], queryFn: answer, placeholderData: keepPreviousData, retry: false })

function Asks({ options }: { options: ReturnType<typeof letter> }) {
  const { data, error, status } = useInSlices(options)
  return <p>{`${status}: ${data ?? error?.message ?? ''}`}</p>
}

const within = (client: QueryClient, children: ReactNode) => (
  <StrictMode>
    <QueryClientProvider client={client}>{children}</QueryClientProvider>
  </StrictMode>
)

test('it tells that it waits, the answer, and what is written over it', async () => {
  const client = new QueryClient()
  render(within(client, <Asks options={letter('a', async () => 'alpha')} />))
  expect(screen.getByText('pending:')).toBeInTheDocument()
  expect(await screen.findByText('success: alpha')).toBeInTheDocument()
  act(() => void client.setQueryData(['a'], 'aleph'))
  expect(await screen.findByText('success: aleph')).toBeInTheDocument()
})

test('a refusal is told with what it says', async () => {
  const answer = () => Promise.reject(new Error('no such letter'))
  render(within(new QueryClient(), <Asks options={letter('a', answer)} />))
  expect(await screen.findByText('error: no such letter')).toBeInTheDocument()
})

test('another question keeps the last answer until its own has come', async () => {
  const client = new QueryClient()
  const { rerender } = render(within(client, <Asks options={letter('a', () => 'alpha')} />))
  await screen.findByText('success: alpha')
  let tell = (_: string) => {}
  const beta = new Promise<string>((come) => {
    tell = come
  })
  rerender(within(client, <Asks options={letter('b', () => beta)} />))
  expect(screen.getByText('success: alpha')).toBeInTheDocument()
  await act(async () => tell('beta'))
  expect(await screen.findByText('success: beta')).toBeInTheDocument()
})

test('what is answered after it was drawn and before it listens is not missed', async () => {
  const client = new QueryClient({ defaultOptions: { queries: { staleTime: Number.POSITIVE_INFINITY } } })
  function Answers() {
    useLayoutEffect(() => void client.setQueryData(['a'], 'alpha'), [])
    return null
  }
  const asked = vi.fn(() => new Promise<string>(() => {}))
  render(
    within(
      client,
      <>
        <Asks options={letter('a', asked)} />
        <Answers />
      </>,
    ),
  )
  expect(await screen.findByText('success: alpha')).toBeInTheDocument()
  expect(asked).not.toHaveBeenCalled()
})

test('while a long answer is drawn the browser runs what else there is', async () => {
  // Outside of `act`, which draws everything at one go.
  vi.stubGlobal('IS_REACT_ACT_ENVIRONMENT', false)
  const client = new QueryClient()
  function Row({ text }: { text: string }) {
    for (const end = performance.now() + 3; performance.now() < end; );
    return <li>{text}</li>
  }
  function Rows() {
    const { data } = useInSlices(letter('a', () => 'alpha'))
    // biome-ignore lint/suspicious/noArrayIndexKey: they are all alike.
    return data ? Array.from({ length: 100 }, (_, index) => <Row key={index} text={data} />) : <p>waits</p>
  }
  const container = document.createElement('div')
  const root = createRoot(container)
  root.render(within(client, <Rows />))
  await vi.waitFor(() => expect(container).toHaveTextContent('waits'))
  let between = 0
  const count = () => {
    if (container.querySelector('li')) return
    if (client.getQueryData(['a'])) between++
    setTimeout(count)
  }
  count()
  await vi.waitFor(() => expect(container.querySelectorAll('li')).toHaveLength(100))
  // At one go it would be twice at most: before the answer is told, and before it is drawn.
  expect(between).toBeGreaterThan(5)
  root.unmount()
})
