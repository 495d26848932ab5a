/** Which metrics are looked at, in which order: any that was reported can be a panel. */
import {
  Button,
  type ComboboxItem,
  Group,
  type OptionsFilter,
  Popover,
  Select,
  type SelectProps,
  Text,
} from '@mantine/core'
import { grouped, MOST_PANELS, USUAL_PANELS } from '../charts/panels'
import type { ChangeView, ChartView } from '../charts/view'
import { metricText, wordsOf } from '../charts/words'
import { IconColumns } from './icons'
import { OrderedList } from './OrderedList'
import classes from './PanelsButton.module.css'

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
          titleOf={metricText}
          least={1}
          onMove={choose}
          onRemove={(place) => choose(panels.filter((_, other) => other !== place))}
        />
        <Group gap="xs" wrap="nowrap">
          <Select
            aria-label="Add a panel"
            placeholder={full ? 'No more fit' : 'Add a metric'}
            searchable
            data={grouped(names.filter((name) => !panels.includes(name))).map(({ group, names: some }) => ({
              group,
              items: some.map((value) => ({ value, label: metricText(value) })),
            }))}
            filter={byWordsAndNames}
            renderOption={Option}
            maxDropdownHeight={320}
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

/** Every word that is typed is one of the metric's, or of its name in the code. */
const byWordsAndNames: OptionsFilter = ({ options, search, limit }) => {
  const typed = search.toLowerCase().split(/\s+/)
  const isMeant = ({ value, label }: ComboboxItem) =>
    typed.every((word) => `${label} ${value}`.toLowerCase().includes(word))
  let left = limit
  return options.flatMap((option) => {
    if (!('group' in option)) return option
    const items = option.items
      .filter((item): item is ComboboxItem => typeof item === 'object' && isMeant(item))
      .slice(0, left)
    left -= items.length
    return items.length > 0 ? { ...option, items } : []
  })
}

/** A metric's words and, beside them, its name in the code; a name alone where it has no words. */
const Option: NonNullable<SelectProps['renderOption']> = ({ option: { value } }) => {
  const { title, note } = wordsOf(value)
  return (
    <div className={classes.option}>
      <span>
        {title}
        {note && <span className={classes.note}>, {note}</span>}
      </span>
      {title !== value && <span className={classes.name}>{value}</span>}
    </div>
  )
}

const same = (one: readonly string[], other: readonly string[]) =>
  one.length === other.length && one.every((name, place) => name === other[place])
