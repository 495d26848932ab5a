/** What metrics are called: the server's words, of which `make types` writes metricWords.json. */
import words from './metricWords.json'

export interface MetricWords {
  title: string
  /** What its values are, with their unit. */
  axis: string
  /** What tells it from others of the same title. */
  note?: string
  /** Whether it is of 0 to 1, and written in per cent. */
  share?: boolean
}

const WORDS: Readonly<Record<string, MetricWords>> = words
/** Stands for the rest of a name, in its key and in its title. */
const REST = '*'

/** The names that have words, without those that are known by their beginning alone. */
export const NAMED: readonly string[] = Object.keys(WORDS).filter((name) => !name.endsWith(REST))

/** Of a metric; one that has none is called by its name, and a rate is a share. */
export function wordsOf(name: string): MetricWords {
  const slash = name.indexOf('/')
  const rest = slash < 0 ? '' : name.slice(slash + 1)
  const found = WORDS[name] ?? (rest ? WORDS[`${name.slice(0, slash)}/${REST}`] : undefined)
  if (!found) {
    const share = name.endsWith('_rate') && !name.endsWith('learning_rate')
    return { title: name, axis: name, ...(share ? { share } : {}) }
  }
  return { ...found, title: found.title.replace(REST, rest.replaceAll('_', ' ').toLowerCase()) }
}

/** A metric on one line: "Success rate, evaluation". */
export function metricText(name: string): string {
  const { title, note } = wordsOf(name)
  return note ? `${title}, ${note}` : title
}
