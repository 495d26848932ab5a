/** How hard the maps of a generated family are, 0 to 1. */
import { Group, Slider, Text } from '@mantine/core'

export function DifficultySlider({
  label,
  value,
  onChange,
}: {
  label: string
  value: number
  onChange: (value: number) => void
}) {
  return (
    <Group gap="sm" maw={420} wrap="nowrap">
      <Text size="sm" component="span" aria-hidden>
        {label}
      </Text>
      <Slider
        flex={1}
        miw={120}
        thumbLabel={label}
        min={0}
        max={1}
        step={0.05}
        label={null}
        value={value}
        onChange={onChange}
      />
      <Text size="sm" component="span" w={34}>
        {value.toFixed(2)}
      </Text>
    </Group>
  )
}
