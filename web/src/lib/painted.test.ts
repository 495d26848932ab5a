import { afterEach, beforeEach, expect, it, vi } from 'vitest'
import { painted } from './painted'

beforeEach(() => void vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout'] }))

afterEach(() => {
  vi.useRealTimers()
  vi.unstubAllGlobals()
})

it('comes when the frame after the next one begins', async () => {
  const frames: FrameRequestCallback[] = []
  vi.stubGlobal('requestAnimationFrame', (callback: FrameRequestCallback) => frames.push(callback))
  const come = vi.fn()
  const seen = painted().then(come)
  frames.shift()?.(0)
  await Promise.resolve()
  expect(come).not.toHaveBeenCalled()
  frames.shift()?.(16)
  await seen
  expect(come).toHaveBeenCalledOnce()
})

it('comes by time in a tab that shows nothing', async () => {
  vi.stubGlobal('requestAnimationFrame', () => 0)
  const seen = painted()
  await vi.advanceTimersByTimeAsync(100)
  await seen
})
