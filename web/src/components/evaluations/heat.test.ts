import { expect, test } from 'vitest'
import { collisionCells } from './heat'

test('collisions are counted in squares of half a metre, the fullest of which is one', () => {
  const cells = collisionCells([
    [0.1, 0.1],
    [0.4, 0.49],
    [-0.1, 0.1],
  ])
  expect(cells).toEqual([
    { x: 0, y: 0, size: 0.5, share: 1 },
    { x: -0.5, y: 0, size: 0.5, share: 0.5 },
  ])
  expect(collisionCells([])).toEqual([])
})
