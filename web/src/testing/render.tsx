/** Renders the application at an address, as a browser would show it. */
import { QueryClientProvider } from '@tanstack/react-query'
import { act, render } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { type Location, MemoryRouter, type NavigateFunction, useLocation, useNavigate } from 'react-router'
import { createQueryClient } from '../api/client'
import { App } from '../app'
import { Providers } from '../components/Providers'

/** The application at `address`; `user` acts on it, `router` tells where it has gone, and goes elsewhere. */
export function open(address: string) {
  const seen = {} as { location: Location; navigate: NavigateFunction }
  function Seen() {
    seen.location = useLocation()
    seen.navigate = useNavigate()
    return null
  }
  const router = {
    state: seen,
    navigate: (to: string | -1) => act(async () => void (await seen.navigate(to as string))),
  }
  const client = createQueryClient()
  client.setDefaultOptions({ queries: { ...client.getDefaultOptions().queries, retry: false } })
  const { unmount } = render(
    <QueryClientProvider client={client}>
      <Providers still>
        <MemoryRouter initialEntries={[address]}>
          <Seen />
          <App />
        </MemoryRouter>
      </Providers>
    </QueryClientProvider>,
  )
  return { router, unmount, user: userEvent.setup({ delay: null }) }
}
