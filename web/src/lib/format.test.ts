import { describe, expect, test } from 'vitest'
import {
  age,
  compact,
  count,
  dateTime,
  duration,
  fileSize,
  percent,
  percentRange,
  plural,
  significant,
  words,
} from './format'

const plain = (text: string) => text.replaceAll('\u202f', ' ')

describe('numbers', () => {
  test.each([
    [0, '0'],
    [999, '999'],
    [1000, '1 000'],
    [1234567.4, '1 234 567'],
    [-12345, '−12 345'],
  ])('count(%d) separates thousands', (value, text) => expect(plain(count(value))).toBe(text))

  test.each([
    [0, '0'],
    [950, '950'],
    [1500, '1.5k'],
    [299_008, '299k'],
    [1_234_567, '1.23M'],
    [-20_000, '−20k'],
    [2.5e9, '2.5G'],
  ])('compact(%d)', (value, text) => expect(compact(value)).toBe(text))

  test.each([
    [0.001, '0.001'],
    [0.012304, '0.0123'],
    [0.00001, '1e−5'],
    [123.456, '123.5'],
    [600_000, '600 000'],
    [Number.NaN, 'not a number'],
  ])('significant(%d)', (value, text) => expect(plain(significant(value))).toBe(text))

  test('a success rate is 100 % only when nothing failed', () => {
    expect(plain(percent(1))).toBe('100 %')
    expect(plain(percent(0.9999))).toBe('99.9 %')
    expect(plain(percent(0))).toBe('0 %')
    expect(plain(percentRange(0.9712, 0.9944))).toBe('97.1–99.4 %')
  })

  test('plurals', () => {
    expect(plural(1, 'seed')).toBe('1 seed')
    expect(plural(5, 'seed')).toBe('5 seeds')
  })
})

describe('times', () => {
  test.each([
    [0, '0 s'],
    [59.4, '59 s'],
    [200, '3 min 20 s'],
    [180, '3 min'],
    [1830, '30 min'],
    [7500, '2 h 5 min'],
    [273_600, '3 d 4 h'],
  ])('duration(%d)', (seconds, text) => expect(duration(seconds)).toBe(text))

  test.each([
    [10, 'just now'],
    [300, '5 min ago'],
    [3 * 3600, '3 h ago'],
    [12 * 86_400, '12 d ago'],
  ])('%d seconds before now', (seconds, text) => expect(age(1_000_000 - seconds, 1_000_000)).toBe(text))

  test('dates are written in one order everywhere', () => {
    expect(dateTime(Date.UTC(2026, 10, 21, 14, 5, 9) / 1000)).toBe('2026-11-21 14:05:09')
  })
})

test.each([
  [512, '512 B'],
  [48_213, '48.2 kB'],
  [1_340_000, '1.34 MB'],
])('fileSize(%d)', (bytes, text) => expect(fileSize(bytes)).toBe(text))

test.each([
  ['learning_rate', 'Learning rate'],
  ['cpu', 'CPU'],
  ['resblock', 'ResBlock'],
  ['simple', 'Simple'],
])('words(%s)', (identifier, text) => expect(words(identifier)).toBe(text))
