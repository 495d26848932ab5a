/** Renders the application at an address, as a browser would show it. */
import { QueryClientProvider } from '@tanstack/react-query'
import { render } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { createMemoryRouter, RouterProvider } from 'react-router'
import { createQueryClient } from '../api/client'
import { routes } from '../app'
import { Providers } from '../components/Providers'

/** The application at `address`; `user` acts on it, `router` tells where it has gone. */
export function open(address: string) {
  const router = createMemoryRouter(routes, { initialEntries: [address] })
  const client = createQueryClient()
  client.setDefaultOptions({ queries: { ...client.getDefaultOptions().queries, retry: false } })
  const { unmount } = render(
    <QueryClientProvider client={client}>
      <Providers still>
        <RouterProvider router={router} />
      </Providers>
    </QueryClientProvider>,
  )
  return { router, unmount, user: userEvent.setup({ delay: null }) }
}
