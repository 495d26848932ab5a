/** What was fitted, each with its interval, and the way to a training that begins with it. */
import { Button, Group, Stack, Table, Text } from '@mantine/core'
import { Link } from 'react-router'
import { significant } from '../../lib/format'
import { IconRocket } from '../icons'
import ui from '../ui.module.css'
import { intervalOf, type Reading, trainWith } from './reading'

export function FittedTable({ reading }: { reading: Reading }) {
  const { fitted, settings, lidar } = reading
  return (
    <Stack gap="sm">
      <Table.ScrollContainer type="native" minWidth={520} tabIndex={0}>
        <Table aria-label="Fitted from the recording">
          <Table.Thead>
            <Table.Tr>
              <Table.Th>Quantity</Table.Th>
              <Table.Th ta="right">Estimate</Table.Th>
              <Table.Th>95 % interval</Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {fitted.map((each) => (
              <Table.Tr key={each.key} data-testid="fitted" data-key={each.key}>
                <Table.Td>
                  {each.title}
                  <Text size="xs" c="dimmed">
                    {each.note}
                  </Text>
                </Table.Td>
                <Table.Td ta="right" className={ui.number}>
                  {each.value === null ? '–' : `${significant(each.value, 3)} ${each.unit}`}
                </Table.Td>
                <Table.Td className={ui.number}>{intervalOf(each)}</Table.Td>
              </Table.Tr>
            ))}
          </Table.Tbody>
        </Table>
      </Table.ScrollContainer>
      <Text size="sm" c="dimmed">
        The LiDAR has {lidar.beams} beams over {lidar.field_of_view}°, up to {lidar.range} m. Trainings keep
        the rays of the form; where it sees less than 180°, they are told.
      </Text>
      <Group>
        <Button component={Link} to={trainWith(settings)} leftSection={<IconRocket size={16} />}>
          Train with these
        </Button>
        <Text size="xs" c="dimmed">
          {settings.map(({ title, value }) => `${title} ${[value].flat().join(' to ')}`).join(' · ')}
        </Text>
      </Group>
    </Stack>
  )
}
