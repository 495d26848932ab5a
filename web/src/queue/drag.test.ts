import { expect, test } from 'vitest'
import { dropAt } from './drag'

const rows = ['a', 'b', 'c'].map((id, index) => ({ id, top: 10 * index, bottom: 10 * index + 10 }))

test('a row is put before or after the one whose half is under the pointer', () => {
  expect(dropAt(rows, 'a', 17)).toEqual({ beside: 'b', side: 'after' })
  expect(dropAt(rows, 'a', 22)).toEqual({ beside: 'c', side: 'before' })
  expect(dropAt(rows, 'c', 2)).toEqual({ beside: 'a', side: 'before' })
  expect(dropAt(rows, 'c', -50)).toEqual({ beside: 'a', side: 'before' })
  expect(dropAt(rows, 'a', 500)).toEqual({ beside: 'c', side: 'after' })
})

test('over itself, and at its own edges, it stays', () => {
  expect(dropAt(rows, 'b', 12)).toBeNull()
  expect(dropAt(rows, 'b', 7)).toBeNull()
  expect(dropAt(rows, 'b', 22)).toBeNull()
  expect(dropAt([], 'b', 2)).toBeNull()
})
