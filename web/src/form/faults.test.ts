import { expect, test } from 'vitest'
import { faultOf } from './faults'

test('every kind of field is told what is wrong in the same words', () => {
  const share = { type: 'number', exclusiveMinimum: 0, maximum: 1 }
  expect(faultOf(share, 0.5)).toBeUndefined()
  expect(faultOf(share, 1.5)).toBe('It must be above 0, at most 1.')
  expect(faultOf(share, null)).toBe('A number is missing.')
  expect(faultOf(share, null, true)).toBeUndefined()
  expect(faultOf(share, '-')).toBe('"-" is no number.')
  const robots = { type: 'integer', minimum: 1, maximum: 4096 }
  expect(faultOf(robots, 2.5)).toBe('It must be a whole number.')
  expect(faultOf(robots, 0)).toMatch(/^It must be 1 to 4\s096\.$/)
  const layers = { type: 'array', items: robots, maxItems: 2 }
  expect(faultOf(layers, [64, 0])).toMatch(/^Each must be 1 to 4\s096\.$/)
  expect(faultOf(layers, [64, 'x'])).toBe('"x" is no number.')
  expect(faultOf(layers, [1, 2, 3])).toBe('It must be 2 at most.')
  expect(faultOf({ type: 'array', items: robots, minItems: 1 }, [])).toBe('One or more are missing.')
  expect(faultOf({ type: 'string', minLength: 1 }, '  ')).toBe('It must not be empty.')
  expect(faultOf({ type: 'string', 'x-imported-arena': true }, '')).toBe('Choose one of the imported arenas.')
})
