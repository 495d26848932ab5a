import { expect, test } from 'vitest'
import { endsOf } from './states'

test('runs that ended differently are said by how they ended', () => {
  expect(endsOf(['completed', 'failed', 'completed'])).toBe('Completed and failed')
  expect(endsOf(['completed', 'failed', 'stopped'])).toBe('Completed, failed and stopped')
})
