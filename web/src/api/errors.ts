/** What can go wrong with a request. */
import type { ValidationProblem } from '../form/problems'

/** The server could not be reached: it is down, restarting, or the network is. */
export class OfflineError extends Error {
  override name = 'OfflineError'
  constructor() {
    super('The server cannot be reached.')
  }
}

/** The server answered, and refused. */
export class ApiError extends Error {
  override name = 'ApiError'
  readonly status: number
  /** A 422's field errors; empty for every other refusal. */
  readonly problems: readonly ValidationProblem[]

  constructor(status: number, message: string, problems: readonly ValidationProblem[] = []) {
    super(message)
    this.status = status
    this.problems = problems
  }
}

/** The error that a refusing response stands for. */
export async function errorOf(response: Response): Promise<ApiError> {
  const body: unknown = await response.json().catch(() => null)
  const detail = body !== null && typeof body === 'object' && 'detail' in body ? body.detail : null
  if (Array.isArray(detail)) {
    return new ApiError(response.status, 'Some values were refused.', detail as ValidationProblem[])
  }
  return new ApiError(
    response.status,
    typeof detail === 'string' ? detail : `The server answered ${response.status} ${response.statusText}.`,
  )
}

/** An error as one sentence for a person. */
export function messageOf(error: unknown): string {
  return error instanceof Error ? error.message : 'Something unexpected happened.'
}

/** What stands in a refusal: the sentences of its fields, or its own. */
export function refusalOf(error: unknown): string {
  const fields = error instanceof ApiError ? error.problems.map(({ msg }) => msg) : []
  return fields.length > 0 ? fields.join(' ') : messageOf(error)
}

/** Whether the server itself refused (and will again), rather than being out of reach. */
export const isRefusal = (error: unknown): boolean => error instanceof ApiError && error.status < 500
export const isNotFound = (error: unknown): boolean => error instanceof ApiError && error.status === 404
export const isUnauthorized = (error: unknown): boolean => error instanceof ApiError && error.status === 401
