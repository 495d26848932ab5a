/** A server at the other end of the network, for the pages' tests: answers requests, remembers them, sends events. */
import { vi } from 'vitest'
import type { Change } from '../api/events'
import { status } from './examples'

/** What a route answers: a body for 200, a Response, or a function of the request; an Error is a broken network. */
type Answer =
  | object
  | Response
  | Error
  | ((request: Request) => Promise<object | Response | Error> | object | Response | Error)

export interface FakeServer {
  /** Answers from now on; "GET /api/status" -> answer. */
  routes: Record<string, Answer>
  /** The requests that changed something: "POST /api/experiments", with their bodies. */
  changes: { route: string; body: unknown }[]
  /** The paths and queries that were asked for. */
  asked: string[]
}

/** Stands in for the network until the test ends. A route that is not given answers 404, the status is given. */
export function startServer(routes: Record<string, Answer>): FakeServer {
  const server: FakeServer = { routes: { 'GET /api/status': status, ...routes }, changes: [], asked: [] }
  vi.stubGlobal('fetch', async (request: Request) => {
    const url = new URL(request.url)
    const route = `${request.method} ${url.pathname}`
    server.asked.push(url.pathname + url.search)
    if (request.method !== 'GET') {
      const text = await request.clone().text()
      server.changes.push({ route, body: text ? JSON.parse(text) : null })
    }
    const given = server.routes[route] ?? refusal(404, 'There is no such thing; it may have been deleted.')
    const answer = typeof given === 'function' ? await given(request) : given
    if (answer instanceof Error) throw answer
    return answer instanceof Response ? answer.clone() : Response.json(answer)
  })
  return server
}

/** A refusal as the server writes it; `detail` is a sentence, or the list of a 422. */
export function refusal(code: number, detail: unknown): Response {
  return Response.json({ detail }, { status: code })
}

/** The browser's end of an event stream, driven by the test. */
export class FakeEventSource extends EventTarget {
  static open: FakeEventSource[] = []
  onerror: (() => void) | null = null
  readyState = 1
  readonly url: string

  constructor(url: string) {
    super()
    this.url = url
    FakeEventSource.open.push(this)
  }

  close() {
    FakeEventSource.open = FakeEventSource.open.filter((one) => one !== this)
  }

  /** As an answer that is no stream ends it: for good. */
  refuse() {
    this.readyState = 2
    this.onerror?.()
  }

  send(change: Change) {
    this.tell('changes', 'e-2', [change])
  }

  /** An event as the server writes it: its name, its id, its data. */
  tell(name: 'opened' | 'changes' | 'resync', lastEventId: string, data: unknown = {}) {
    this.dispatchEvent(new MessageEvent(name, { lastEventId, data: JSON.stringify(data) }))
  }
}
