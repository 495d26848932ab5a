import { expect, test } from 'vitest'
import { pinched } from './pinch'

const ALL = [0, 100] as const

test('fingers that part twice as far show half, and what was between them stays there', () => {
  const shown = pinched(ALL, ALL, { middle: 0.25, apart: 50 }, { middle: 0.25, apart: 100 })
  expect(shown).toEqual([12.5, 62.5])
})

test('fingers that move together take what is shown along', () => {
  const from = [40, 60] as const
  expect(pinched(from, ALL, { middle: 0.5, apart: 80 }, { middle: 0.25, apart: 80 })).toEqual([45, 65])
})

test('nothing beyond the ends is shown, and all of it is no zoom', () => {
  const from = [0, 50] as const
  expect(pinched(from, ALL, { middle: 0.5, apart: 80 }, { middle: 1, apart: 80 })).toEqual([0, 50])
  expect(pinched(from, ALL, { middle: 0.5, apart: 80 }, { middle: 0.5, apart: 20 })).toBeNull()
})
