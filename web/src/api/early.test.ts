import { afterEach, expect, test, vi } from 'vitest'
import { api } from './client'
import { OfflineError } from './errors'

const fetched = vi.fn(async () => Response.json({ from: 'fetch' }))

afterEach(() => {
  fetched.mockClear()
  delete window.early
})

function asked(answer: Promise<Response>): void {
  vi.stubGlobal('fetch', fetched)
  window.early = new Map([['/api/account', answer]])
}

test('what the HTML has asked for is taken up once, and then asked for as ever', async () => {
  asked(Promise.resolve(Response.json({ from: 'HTML' })))
  expect((await api.GET('/api/account')).data).toEqual({ from: 'HTML' })
  expect((await api.GET('/api/account')).data).toEqual({ from: 'fetch' })
  expect(fetched).toHaveBeenCalledTimes(1)
})

test('another question is none of its', async () => {
  asked(Promise.resolve(Response.json({ from: 'HTML' })))
  expect((await api.GET('/api/policies')).data).toEqual({ from: 'fetch' })
  expect(window.early?.size).toBe(1)
})

test('a refusal, or a server out of reach, is told like any other', async () => {
  asked(Promise.resolve(Response.json({ detail: 'No.' }, { status: 403 })))
  await expect(api.GET('/api/account')).rejects.toThrow('No.')
  asked(Promise.reject(new TypeError('Failed to fetch')))
  await expect(api.GET('/api/account')).rejects.toBeInstanceOf(OfflineError)
})
