/** Starts the pages. */
import '@mantine/core/styles.css'
import '@mantine/notifications/styles.css'
import './global.css'
import { QueryClientProvider } from '@tanstack/react-query'
import { StrictMode, useLayoutEffect } from 'react'
import { createRoot } from 'react-dom/client'
import { RouterProvider } from 'react-router/dom'
import { createQueryClient } from './api/client'
import { createRouter } from './app'
import { Providers } from './components/Providers'

const root = document.getElementById('root')
if (!root) throw new Error('index.html has no element with the id "root".')

/** Takes the frame of index.html away in the same picture in which the application's own stands. */
function FrameGone() {
  useLayoutEffect(() => document.getElementById('frame')?.remove(), [])
  return null
}

createRoot(root).render(
  <StrictMode>
    <FrameGone />
    <QueryClientProvider client={createQueryClient()}>
      <Providers>
        <RouterProvider router={createRouter()} />
      </Providers>
    </QueryClientProvider>
  </StrictMode>,
)
