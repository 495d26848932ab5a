import { waitFor } from '@testing-library/react'
import { beforeEach, expect, test, vi } from 'vitest'
import { open } from '../testing/render'
import { FakeEventSource, startServer } from '../testing/server'

const scrolled = vi.fn()

beforeEach(() => {
  scrolled.mockClear()
  vi.stubGlobal('scrollTo', scrolled)
  vi.stubGlobal('EventSource', FakeEventSource)
  startServer({})
})

test('another page begins at its top', async () => {
  const { router } = open('/policies')
  expect(scrolled).not.toHaveBeenCalled()
  await router.navigate('/arenas')
  await waitFor(() => expect(scrolled).toHaveBeenCalledExactlyOnceWith(0, 0))
})

test('what changes in the address of one page moves nothing, nor does the way back', async () => {
  const { router } = open('/policies')
  await router.navigate('/policies?page=2')
  await router.navigate('/policies#matrix')
  expect(scrolled).not.toHaveBeenCalled()
  await router.navigate('/arenas')
  await waitFor(() => expect(scrolled).toHaveBeenCalled())
  scrolled.mockClear()
  await router.navigate(-1)
  expect(router.state.location.pathname).toBe('/policies')
  expect(scrolled).not.toHaveBeenCalled()
})
