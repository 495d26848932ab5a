/** How all charts of a page are looked at: what x is, and whether it is logarithmic. */
import { Checkbox, Group, NativeSelect, Text } from '@mantine/core'
import { ACROSS, type Across, isCounted } from '../charts/across'
import type { ChangeView, ChartView } from '../charts/view'

interface ChartControlsProps {
  view: ChartView
  onView: ChangeView
  /** All metrics that were reported. */
  reported: readonly string[]
}

export function ChartControls({ view, onView, reported }: ChartControlsProps) {
  const options = (Object.keys(ACROSS) as Across[]).map((value) => {
    const known = isCounted(reported, value)
    return {
      value,
      label: known ? ACROSS[value].label : `${ACROSS[value].label}, not counted`,
      disabled: !known,
    }
  })
  return (
    <Group gap="xs" wrap="nowrap">
      <Text size="xs" c="dimmed" aria-hidden>
        Horizontal axis
      </Text>
      <NativeSelect
        size="xs"
        aria-label="Horizontal axis"
        value={view.across}
        data={options}
        onChange={(event) => onView({ across: event.currentTarget.value as Across })}
      />
      <Checkbox
        size="xs"
        label="Log"
        aria-label="Log horizontal axis"
        checked={view.logX}
        onChange={(event) => onView({ logX: event.currentTarget.checked })}
      />
    </Group>
  )
}
