import { expect, test } from 'vitest'
import { settingText } from './settingText'
import cases from './settingTexts.json'

// The server prints the same ones (tests/server/test_printing.py).
test.each(cases)('$value is written $text', ({ value, text }) => {
  expect(settingText(value)).toBe(text)
})
