/** Starts the pages. */
import '@mantine/core/styles/baseline.layer.css'
import '@mantine/core/styles/default-css-variables.layer.css'
import '@mantine/core/styles/global.layer.css'
import 'virtual:theme.css'
import './global.css'
import { QueryClientProvider } from '@tanstack/react-query'
import { StrictMode, startTransition, useLayoutEffect } from 'react'
import { createRoot } from 'react-dom/client'
import { BrowserRouter } from 'react-router'
import { createQueryClient } from './api/client'
import { App } from './app'
import { Providers } from './components/Providers'
import { BASE } from './lib/base'

const root = document.getElementById('root')
if (!root) throw new Error('index.html has no element with the id "root".')

/** Takes the frame of the HTML away in the same picture in which the application's own stands; the focus goes along. */
function FrameGone() {
  useLayoutEffect(() => {
    const frame = document.getElementById('frame')
    const focused = frame?.querySelector(':focus')
    const there = focused && document.querySelector<HTMLElement>(`#root ${selectorOf(focused)}`)
    frame?.remove()
    there?.focus()
  }, [])
  return null
}

const selectorOf = (element: Element) =>
  element instanceof HTMLAnchorElement
    ? `${element.closest('main') ? 'main' : 'header'} a[href="${element.getAttribute('href')}"]:not([aria-label="Mapless, home"])`
    : `[aria-label="${element.getAttribute('aria-label')}"]`

// A transition: drawn in slices, between which the browser answers.
startTransition(() =>
  createRoot(root).render(
    <StrictMode>
      <QueryClientProvider client={createQueryClient()}>
        <Providers>
          <BrowserRouter basename={BASE}>
            <App />
          </BrowserRouter>
        </Providers>
      </QueryClientProvider>
      <FrameGone />
    </StrictMode>,
  ),
)
