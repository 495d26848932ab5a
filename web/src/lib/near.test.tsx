import { act, render } from '@testing-library/react'
import { useEffect, useRef } from 'react'
import { afterEach, expect, test, vi } from 'vitest'
import { Below } from '../components/Below'
import { useInSight, useNear } from './near'

/** The browser's, told by the test what is seen. */
class Observer {
  static all: ((isIntersecting: boolean) => void)[] = []
  static tell(isIntersecting: boolean) {
    act(() => {
      for (const each of Observer.all) each(isIntersecting)
    })
  }
  constructor(callback: (entries: { isIntersecting: boolean }[]) => void) {
    Observer.all.push((isIntersecting) => callback([{ isIntersecting }]))
  }
  observe() {}
  disconnect() {}
}

afterEach(() => {
  Observer.all = []
  vi.useRealTimers()
  vi.unstubAllGlobals()
})

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

function Heavy({ name }: { name: string }) {
  const place = useRef<HTMLDivElement>(null)
  return <div ref={place}>{useNear(place, true) && name}</div>
}

const turn = () => act(() => vi.advanceTimersToNextTimer())

test('what comes near at once is made one by one, each in a turn of its own', () => {
  vi.stubGlobal('IntersectionObserver', Observer)
  vi.useFakeTimers()
  const { container } = render(['a', 'b', 'c'].map((name) => <Heavy key={name} name={name} />))
  Observer.tell(true)
  const seen = [container.textContent]
  for (let turns = 0; turns < 3; turns++) {
    turn()
    seen.push(container.textContent)
  }
  expect(seen).toEqual(['', 'a', 'ab', 'abc'])
})

test('the parts below are made from above, and what is not made yet keeps its place', () => {
  vi.stubGlobal('IntersectionObserver', Observer)
  vi.useFakeTimers()
  const { container } = render(
    <Below height={900} waits>
      <p>one</p>
      {null}
      <p>two</p>
      <p>three</p>
    </Below>,
  )
  const room = () => container.querySelector('div > div')?.getAttribute('style')
  expect(room()).toContain('height: 900px')
  Observer.tell(true)
  turn()
  expect([container.textContent, room()]).toEqual(['one', expect.stringContaining('height: 600px')])
  turn()
  expect(container.textContent).toBe('onetwo')
  turn()
  expect([container.textContent, room()]).toEqual(['onetwothree', undefined])
})

test('what the address asks for is made at once, with all that stands beside it', () => {
  vi.stubGlobal('IntersectionObserver', Observer)
  const { container } = render(
    <Below height={900} now>
      <p>one</p>
      <p>two</p>
    </Below>,
  )
  expect(container.textContent).toBe('onetwo')
})
