import { act, render } from '@testing-library/react'
import { useEffect, useRef } from 'react'
import { expect, test, vi } from 'vitest'
import { useInSight } from './near'

/** The browser's, told by the test what is seen. */
class Observer {
  static tell: (isIntersecting: boolean) => void = () => {}
  constructor(callback: (entries: { isIntersecting: boolean }[]) => void) {
    Observer.tell = (isIntersecting) => act(() => callback([{ isIntersecting }]))
  }
  observe() {}
  disconnect() {}
}

function Drawing({ value, draw }: { value: number; draw: (value: number) => void }) {
  const place = useRef<HTMLDivElement>(null)
  const inSight = useInSight(place, () => draw(value))
  // biome-ignore lint/correctness/useExhaustiveDependencies: drawn anew for each value.
  useEffect(() => {
    if (inSight.current) draw(value)
  }, [value])
  return <div ref={place} />
}

test('what is out of sight is drawn when it comes into sight, and then what is newest', () => {
  vi.stubGlobal('IntersectionObserver', Observer)
  const draw = vi.fn()
  const { rerender } = render(<Drawing value={1} draw={draw} />)
  expect(draw.mock.calls).toEqual([[1]])

  Observer.tell(false)
  rerender(<Drawing value={2} draw={draw} />)
  rerender(<Drawing value={3} draw={draw} />)
  expect(draw.mock.calls).toEqual([[1]])

  Observer.tell(true)
  expect(draw.mock.calls).toEqual([[1], [3]])
  Observer.tell(true)
  rerender(<Drawing value={4} draw={draw} />)
  expect(draw.mock.calls).toEqual([[1], [3], [4]])
})
