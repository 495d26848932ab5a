/** The line in which trainings are searched for: it completes keys and values, and shows where a query is at fault. */
import { Combobox, Text, TextInput, useCombobox } from '@mantine/core'
import { useDebouncedValue } from '@mantine/hooks'
import { useEffect, useRef, useState } from 'react'
import { $api } from '../api/client'
import { ApiError } from '../api/errors'
import type { KnownKey } from '../api/types'
import { IconSearch } from '../components/icons'
import { completionAt, quoted } from './complete'
import classes from './workbench.module.css'

const SHOWN = 12
const REST_MS = 250

interface QueryInputProps {
  query: string
  onQuery: (query: string) => void
  /** What the server said of the query. */
  error: unknown
}

export function QueryInput({ query, onQuery, error }: QueryInputProps) {
  const [text, setText] = useState(query)
  const [cursor, setCursor] = useState(0)
  const sent = useRef(query)
  const [rested] = useDebouncedValue(text, REST_MS)
  const input = useRef<HTMLInputElement>(null)
  const combobox = useCombobox({ onDropdownClose: () => combobox.resetSelectedOption() })
  useEffect(() => {
    // Another address: a saved view, or the way back.
    if (query !== sent.current) {
      sent.current = query
      setText(query)
    }
  }, [query])
  useEffect(() => {
    if (rested.trim() !== sent.current.trim()) {
      sent.current = rested
      onQuery(rested)
    }
  }, [rested, onQuery])

  const at = completionAt(text.slice(0, cursor))
  const options = useOptions(at, combobox.dropdownOpened)
  const complete = (option: string) => {
    const typed = at.kind === 'key' ? `${option} ` : `${quoted(option)} `
    const next = text.slice(0, at.start) + typed + text.slice(cursor).trimStart()
    setText(next)
    combobox.resetSelectedOption()
    requestAnimationFrame(() => {
      input.current?.setSelectionRange(at.start + typed.length, at.start + typed.length)
      setCursor(at.start + typed.length)
    })
  }
  const fault = faultOf(error)
  return (
    <Combobox
      store={combobox}
      onOptionSubmit={complete}
      position="bottom-start"
      width={420}
      middlewares={{ shift: true, flip: false }}
    >
      <Combobox.Target>
        <TextInput
          ref={input}
          className={classes.query}
          aria-label="Search and filter"
          placeholder="Search, or filter: algorithm = ppo  success > 0.9"
          leftSection={<IconSearch size={16} />}
          value={text}
          spellCheck={false}
          autoComplete="off"
          error={fault && <Fault text={query} {...fault} />}
          onChange={({ currentTarget }) => {
            setText(currentTarget.value)
            setCursor(currentTarget.selectionStart ?? currentTarget.value.length)
            combobox.openDropdown()
            combobox.updateSelectedOptionIndex()
          }}
          onSelect={({ currentTarget }) => setCursor(currentTarget.selectionStart ?? 0)}
          onClick={() => combobox.openDropdown()}
          onBlur={() => combobox.closeDropdown()}
        />
      </Combobox.Target>
      <Combobox.Dropdown hidden={options.length === 0}>
        <Combobox.Options mah={300} style={{ overflowY: 'auto' }}>
          {options.map(({ value, meaning }) => (
            <Combobox.Option key={value} value={value} className={classes.option}>
              <span>{value}</span>
              <Text span size="xs" c="dimmed" truncate>
                {meaning}
              </Text>
            </Combobox.Option>
          ))}
        </Combobox.Options>
      </Combobox.Dropdown>
    </Combobox>
  )
}

function useOptions(
  at: ReturnType<typeof completionAt>,
  open: boolean,
): { value: string; meaning: string }[] {
  const keys = useKeys(open)
  const known = keys.find(({ key }) => key === at.key)
  const [part] = useDebouncedValue(at.part, REST_MS)
  const asked = at.kind === 'value' && open && (known?.values.length ?? 0) === 0 && !at.key.includes('/')
  const values = $api.useQuery(
    'get',
    '/api/workbench/values',
    { params: { query: { key: at.key, part } } },
    { enabled: asked, retry: false, staleTime: 30_000 },
  )
  if (at.kind === 'key') {
    const wanted = at.part.toLowerCase()
    return keys
      .filter(({ key }) => key.toLowerCase().includes(wanted) && key !== at.part)
      .sort((one, other) => rank(one.key, wanted) - rank(other.key, wanted))
      .slice(0, SHOWN)
      .map(({ key, meaning, of }) => ({ value: key, meaning: meaning || of }))
  }
  const found = known?.values.length ? known.values : asked ? (values.data ?? []) : []
  return found
    .filter((value) => value.toLowerCase().includes(at.part.toLowerCase()) && value !== at.part)
    .slice(0, SHOWN)
    .map((value) => ({ value, meaning: '' }))
}

/** What begins with it first, then what has it after a dot or a slash. */
function rank(key: string, part: string): number {
  const text = key.toLowerCase()
  if (text.startsWith(part)) return 0
  return text.includes(`.${part}`) || text.includes(`/${part}`) ? 1 : 2
}

/** Everything that can be asked for, once it is needed. */
export function useKeys(enabled: boolean): readonly KnownKey[] {
  const { data } = $api.useQuery('get', '/api/workbench/keys', undefined, { enabled, staleTime: 30_000 })
  return data?.items ?? []
}

function faultOf(error: unknown): { message: string; position: number } | null {
  if (!(error instanceof ApiError)) return null
  const problem = error.problems.find(({ ctx }) => ctx?.position !== undefined)
  return problem ? { message: problem.msg, position: problem.ctx?.position ?? 0 } : null
}

/** The query with its fault marked, and what is wrong there. */
function Fault({ text, message, position }: { text: string; message: string; position: number }) {
  const end = Math.max(position + 1, position + (/^[^\s()]+/.exec(text.slice(position))?.[0].length ?? 1))
  return (
    <span role="alert">
      {message}
      {text.length > 0 && (
        <code className={classes.fault}>
          {text.slice(0, position)}
          <mark>{text.slice(position, end) || ' '}</mark>
          {text.slice(end)}
        </code>
      )}
    </span>
  )
}
