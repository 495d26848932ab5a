/** What can follow in a query where one types: keys, or values of the key before. */

export interface Completion {
  kind: 'key' | 'value'
  /** The key that a value is for; empty for a key. */
  key: string
  /** What has been typed of it. */
  part: string
  /** Where that begins in the text. */
  start: number
}

const WORD = '[^\\s()",=<>!~]'
const VALUE = new RegExp(
  `(${WORD}+)\\s*(?:!=|<=|>=|=|<|>|~)\\s*(?:(?:"[^"]*"|${WORD}+)\\s*,\\s*)*("?)([^",()]*)$`,
)
const KEY = new RegExp(`(?:^|[\\s(])-?(${WORD}*)$`)

/** What is being typed at the end of `before`, the text in front of the cursor. */
export function completionAt(before: string): Completion {
  const value = VALUE.exec(before)
  if (value) {
    const [, key = '', quote = '', part = ''] = value
    if (quote || !/\s/.test(part)) {
      return { kind: 'value', key, part, start: before.length - part.length - quote.length }
    }
  }
  const part = KEY.exec(before)?.[1] ?? ''
  return { kind: 'key', key: '', part, start: before.length - part.length }
}

/** A value as the query language writes it. */
export const quoted = (value: string): string => (new RegExp(`^${WORD}+$`).test(value) ? value : `"${value}"`)
