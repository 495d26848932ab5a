/** Which columns the table has, in which order, and which stay in sight. */
import { ActionIcon, Button, Group, Popover, Select, Text, Tooltip } from '@mantine/core'
import type { KnownKey } from '../api/types'
import { IconArrowDown, IconArrowUp, IconColumns, IconPin, IconX } from '../components/icons'
import { titleOf } from './cells'
import { DEFAULT_COLUMNS, type TableView } from './view'
import classes from './workbench.module.css'

const MAX_COLUMNS = 40

interface ColumnsButtonProps {
  view: TableView
  onView: (change: Partial<TableView>) => void
  keys: readonly KnownKey[]
}

export function ColumnsButton({ view, onView, keys }: ColumnsButtonProps) {
  const { columns, pinned } = view
  const move = (place: number, by: number) => {
    const next = [...columns]
    const [key] = next.splice(place, 1)
    if (key !== undefined) next.splice(place + by, 0, key)
    onView({ columns: next })
  }
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
        <ol className={classes.columns} aria-label="Columns">
          {columns.map((key, place) => (
            <li key={key}>
              <span title={key}>{titleOf(key)}</span>
              <Small
                label={place < pinned ? `Unpin up to ${key}` : `Pin up to ${key}`}
                pressed={place < pinned}
                onClick={() => onView({ pinned: place < pinned ? place : place + 1 })}
              >
                <IconPin size={14} />
              </Small>
              <Small label={`Move ${key} up`} disabled={place === 0} onClick={() => move(place, -1)}>
                <IconArrowUp size={14} />
              </Small>
              <Small
                label={`Move ${key} down`}
                disabled={place === columns.length - 1}
                onClick={() => move(place, 1)}
              >
                <IconArrowDown size={14} />
              </Small>
              <Small label={`Remove ${key}`} onClick={() => remove(place)}>
                <IconX size={14} />
              </Small>
            </li>
          ))}
        </ol>
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

function Small({
  label,
  pressed,
  disabled,
  onClick,
  children,
}: {
  label: string
  pressed?: boolean | undefined
  disabled?: boolean | undefined
  onClick: () => void
  children: React.ReactNode
}) {
  return (
    <Tooltip label={label}>
      <ActionIcon
        variant={pressed ? 'light' : 'subtle'}
        {...(pressed ? {} : { color: 'gray' })}
        size="sm"
        aria-label={label}
        aria-pressed={pressed}
        disabled={disabled ?? false}
        onClick={onClick}
      >
        {children}
      </ActionIcon>
    </Tooltip>
  )
}
