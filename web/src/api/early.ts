/** The answers to what the HTML has asked for already (asks.ts). */

declare global {
  interface Window {
    /** By path and query; public/frame.js fills it, and empties it when nobody came for them. */
    early?: Map<string, Promise<Response>>
  }
}

/** The answer to a request, where it is on its way: each is taken once. */
export function early({ method, url }: Request): Promise<Response> | undefined {
  if (method !== 'GET') return undefined
  const { pathname, search } = new URL(url)
  const answer = window.early?.get(pathname + search)
  window.early?.delete(pathname + search)
  return answer
}
