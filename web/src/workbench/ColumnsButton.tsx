/** Which columns the table has, in which order, and which stay in sight. */
import { Button, Group, Popover, Select, Text } from '@mantine/core'
import type { KnownKey } from '../api/types'
import { IconColumns, IconPin } from '../components/icons'
import { OrderedList, SmallButton } from '../components/OrderedList'
import { titleOf } from './cells'
import { DEFAULT_COLUMNS, type TableView } from './view'

const MAX_COLUMNS = 40

interface ColumnsButtonProps {
  view: TableView
  onView: (change: Partial<TableView>) => void
  keys: readonly KnownKey[]
}

export function ColumnsButton({ view, onView, keys }: ColumnsButtonProps) {
  const { columns, pinned } = view
  const remove = (place: number) =>
    onView({
      columns: columns.filter((_, other) => other !== place),
      pinned: place < pinned ? pinned - 1 : pinned,
    })
  const others = keys.map(({ key }) => key).filter((key) => key !== 'name' && !columns.includes(key))
  return (
    <Popover position="bottom-end" width={320} shadow="md" trapFocus>
      <Popover.Target>
        <Button variant="default" leftSection={<IconColumns size={16} />}>
          Columns
        </Button>
      </Popover.Target>
      <Popover.Dropdown>
        <OrderedList
          label="Columns"
          items={columns}
          titleOf={titleOf}
          extra={(key, place) => (
            <SmallButton
              label={place < pinned ? `Unpin up to ${key}` : `Pin up to ${key}`}
              pressed={place < pinned}
              onClick={() => onView({ pinned: place < pinned ? place : place + 1 })}
            >
              <IconPin size={14} />
            </SmallButton>
          )}
          onMove={(moved) => onView({ columns: moved })}
          onRemove={remove}
        />
        <Group gap="xs" wrap="nowrap">
          <Select
            aria-label="Add a column"
            placeholder="Add a setting or metric"
            searchable
            data={others}
            value={null}
            limit={100}
            disabled={columns.length >= MAX_COLUMNS}
            onChange={(key) => key && onView({ columns: [...columns, key] })}
            comboboxProps={{ withinPortal: false }}
            style={{ flex: 1 }}
          />
          <Button
            variant="subtle"
            size="compact-sm"
            onClick={() => onView({ columns: DEFAULT_COLUMNS, pinned: 0 })}
          >
            Usual
          </Button>
        </Group>
        <Text size="xs" c="dimmed" mt={6}>
          The name always stays in sight.
        </Text>
      </Popover.Dropdown>
    </Popover>
  )
}
