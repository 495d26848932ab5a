/** A table of people's things: its head, its rows, and what stands there while it loads, is empty or failed. */
import { Table, Text, VisuallyHidden } from '@mantine/core'
import type { ReactNode } from 'react'
import { LoadingRows, QueryError } from '../ui'

interface RowsProps {
  what: string
  head: readonly string[]
  query: { isPending: boolean; isError: boolean; error: unknown; refetch: () => unknown }
  empty: string
  /** Pixels below which it scrolls sideways. */
  minWidth?: number
  children: readonly ReactNode[] | undefined
}

export function Rows({ what, head, query, empty, minWidth = 520, children }: RowsProps) {
  if (query.isError && !children) {
    return <QueryError error={query.error} what={what} retry={() => void query.refetch()} />
  }
  if (children?.length === 0) {
    return (
      <Text size="sm" c="dimmed" p="md">
        {empty}
      </Text>
    )
  }
  return (
    <Table.ScrollContainer type="native" minWidth={minWidth} tabIndex={0}>
      <Table aria-label={what} aria-busy={!children}>
        <Table.Thead>
          <Table.Tr>
            {head.map((title) => (
              <Table.Th key={title}>{title || <VisuallyHidden>Actions</VisuallyHidden>}</Table.Th>
            ))}
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>{children ?? <LoadingRows rows={1} columns={head.length} />}</Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  )
}
