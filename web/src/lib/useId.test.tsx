import { render } from '@testing-library/react'
import { expect, test } from 'vitest'
import { useId } from './useId'

test('each has its own, which a selector can name and which stays, or the given one, and none is drawn twice', () => {
  const drawn: string[] = []
  function Named({ id }: { id?: string }) {
    const own = useId(id)
    drawn.push(own)
    return <i id={own} />
  }
  const all = () => (
    <>
      <Named />
      <Named />
      <Named id="given" />
    </>
  )
  const { container, rerender } = render(all())
  const [one, other, given] = drawn
  expect(drawn).toHaveLength(3)
  expect(one).not.toBe(other)
  expect(given).toBe('given')
  expect(container.querySelector(`#${one}`)).not.toBeNull()

  rerender(all())
  expect([...container.querySelectorAll('i')].map(({ id }) => id)).toEqual([one, other, given])
})
