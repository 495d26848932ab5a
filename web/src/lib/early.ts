/** What the HTML has asked before the application came (public/frame.js): of a page that is called what the API says, that. */

interface Early {
  /** Path of the page. */
  page: string
  question: string
  answer: Promise<Response> | undefined
  /** Once the answer has come: the page's name, and with some what it is. */
  title: string | undefined
  about: string | undefined
}

declare global {
  interface Window {
    maplessEarly?: Early | undefined
  }
}

/** The head of the page that was opened first, while it is that, as far as it is known already. */
export const earlyHead = (): Partial<Pick<Early, 'title' | 'about'>> =>
  window.maplessEarly?.page === window.location.pathname ? window.maplessEarly : {}

/**
 * The answer to a request that was sent already; once, since it is of then. Where it never came or was a refusal, as of who
 * has signed in since, the request is sent.
 */
export function earlyAnswer(request: Request): Promise<Response> | undefined {
  const early = window.maplessEarly
  if (!early?.answer || request.method !== 'GET' || request.url !== early.question) return undefined
  const { answer } = early
  early.answer = undefined
  const ask = () => globalThis.fetch(request)
  return answer.then((response) => (response.ok ? response : ask()), ask)
}
