import { afterEach, expect, test, vi } from 'vitest'
import { FIRST_QUESTIONS, ROUTES } from '../routes'
import { open } from '../testing/render'
import { FakeEventSource, startServer } from '../testing/server'
import { earlyAnswer, earlyHead } from './early'

const question = new URL('/api/runs/abc', window.location.href).href

function early(answer: Promise<Response>) {
  window.maplessEarly = {
    page: window.location.pathname,
    question,
    answer,
    title: 'Mine, seed 0',
    about: undefined,
  }
}

afterEach(() => {
  window.maplessEarly = undefined
})

test('an answer is taken by the request that asks the same, and once', async () => {
  early(Promise.resolve(Response.json({ seed: 0 })))
  expect(earlyAnswer(new Request(`${question}/log`))).toBeUndefined()
  expect(earlyAnswer(new Request(question, { method: 'DELETE' }))).toBeUndefined()
  expect(await (await earlyAnswer(new Request(question)))?.json()).toEqual({ seed: 0 })
  expect(earlyAnswer(new Request(question))).toBeUndefined()
})

test.each([
  ['never came', () => Promise.reject(new TypeError('no network'))],
  [
    'was refused before somebody signed in',
    async () => Response.json({ detail: 'Sign in.' }, { status: 401 }),
  ],
])('what %s is asked for', async (_, answer) => {
  const asked = vi.fn(async () => Response.json({ seed: 1 }))
  vi.stubGlobal('fetch', asked)
  early(answer())
  expect(await (await earlyAnswer(new Request(question)))?.json()).toEqual({ seed: 1 })
  expect(asked).toHaveBeenCalledOnce()
})

test('the name is that of the page that was opened, and of no other', () => {
  early(Promise.resolve(Response.json({})))
  expect(earlyHead().title).toBe('Mine, seed 0')
  window.history.pushState({}, '', '/runs/other')
  expect(earlyHead().title).toBeUndefined()
})

test.each(Object.entries(FIRST_QUESTIONS))('%s asks what its HTML says', async (name, questions) => {
  vi.stubGlobal('EventSource', FakeEventSource)
  const server = startServer({})
  const [address = ''] = Object.entries(ROUTES).find(([, page]) => page === name) ?? []
  open(address.replace(/:\w+/, 'abc'))
  for (const each of questions) {
    await vi.waitFor(() => expect(server.asked).toContain(each.replace(/{\w+}/, 'abc')), { timeout: 20_000 })
  }
})
