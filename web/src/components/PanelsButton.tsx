/** Which metrics are looked at, in which order: any that was reported can be a panel. */
import { Button, Group, Popover, Select, Text } from '@mantine/core'
import { MOST_PANELS, USUAL_PANELS } from '../charts/panels'
import type { ChangeView, ChartView } from '../charts/view'
import { IconColumns } from './icons'
import { OrderedList } from './OrderedList'

interface PanelsButtonProps {
  view: ChartView
  onView: ChangeView
  /** Metrics that were reported. */
  names: readonly string[]
}

export function PanelsButton({ view, onView, names }: PanelsButtonProps) {
  const panels = view.panels ?? USUAL_PANELS
  const choose = (next: readonly string[]) => onView({ panels: same(next, USUAL_PANELS) ? null : next })
  const full = panels.length >= MOST_PANELS
  return (
    <Popover position="bottom-end" width={340} shadow="md" trapFocus>
      <Popover.Target>
        <Button variant="default" size="xs" leftSection={<IconColumns size={14} />}>
          Panels
        </Button>
      </Popover.Target>
      <Popover.Dropdown>
        <OrderedList
          label="Panels"
          items={panels}
          titleOf={(name) => name}
          least={1}
          onMove={choose}
          onRemove={(place) => choose(panels.filter((_, other) => other !== place))}
        />
        <Group gap="xs" wrap="nowrap">
          <Select
            aria-label="Add a panel"
            placeholder={full ? 'No more fit' : 'Add a metric'}
            searchable
            data={names.filter((name) => !panels.includes(name))}
            nothingFoundMessage="No such metric was reported"
            value={null}
            limit={100}
            disabled={full}
            onChange={(name) => name && choose([...panels, name])}
            comboboxProps={{ withinPortal: false }}
            style={{ flex: 1 }}
          />
          <Button variant="subtle" size="compact-sm" onClick={() => onView({ panels: null })}>
            Usual
          </Button>
        </Group>
        <Text size="xs" c="dimmed" mt={6}>
          {MOST_PANELS} at most. The address keeps them.
        </Text>
      </Popover.Dropdown>
    </Popover>
  )
}

const same = (one: readonly string[], other: readonly string[]) =>
  one.length === other.length && one.every((name, place) => name === other[place])
