/** Leads through a list that comes in pages. */
import { Group, Pagination, Text } from '@mantine/core'
import { count } from '../lib/format'

interface PagerProps {
  /** Which page is shown, from 1. */
  page: number
  /** Items of a page, at most. */
  size: number
  /** Items on all pages. */
  total: number
  /** What the items are, for screen readers: "Pages of trainings". */
  label: string
  onChange: (page: number) => void
}

/** Nothing where one page holds everything. */
export function Pager({ page, size, total, label, onChange }: PagerProps) {
  if (total <= size && page === 1) return null
  const first = (page - 1) * size + 1
  return (
    <Group justify="space-between" gap="xs" p="sm">
      <Text size="xs" c="dimmed">
        {first > total ? 'none' : `${count(first)}–${count(Math.min(total, page * size))}`} of {count(total)}
      </Text>
      <Pagination
        size="sm"
        value={page}
        total={Math.max(page, Math.ceil(total / size))}
        onChange={onChange}
        aria-label={label}
        getControlProps={(control) => ({ 'aria-label': control === 'next' ? 'Next page' : 'Previous page' })}
      />
    </Group>
  )
}
