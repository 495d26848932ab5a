/** Suites of one's own: what each has, the way to measure on it, and to be rid of it. */
import { Button, Group, Table, Text } from '@mantine/core'
import { useState } from 'react'
import { Link } from 'react-router'
import { $api } from '../../api/client'
import { plural } from '../../lib/format'
import { DeleteButton } from '../DeleteButton'
import { DeleteDialog } from '../DeleteDialog'
import table from '../ExperimentTable.module.css'
import { useChange } from '../people/useChange'
import { Panel } from '../ui'
import { evaluate, suiteOfOnesOwn } from './choices'

/** Nothing where there is none: the playground says how one begins. */
export function OwnSuites() {
  const settle = useChange()
  const { data } = $api.useQuery('get', '/api/suites')
  const [deleted, setDeleted] = useState<{ id: string; name: string }>()
  const remove = $api.useMutation('delete', '/api/suites/{suite_id}', settle('delete this suite'))
  if (!data || data.length === 0) return null
  return (
    <Panel title="Suites of your own" flush>
      <Table.ScrollContainer type="native" minWidth={340}>
        <Table className={table.table} aria-label="Suites of your own">
          <Table.Thead>
            <Table.Tr>
              <Table.Th>Suite</Table.Th>
              <Table.Th>Scenarios</Table.Th>
              <Table.Th ta="right">Measure, delete</Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {data.map(({ id, name, scenarios }) => (
              <Table.Tr key={id} data-testid="own-suite">
                <Table.Td>{name}</Table.Td>
                <Table.Td>
                  <Text size="sm" lineClamp={1}>
                    {scenarios.length === 0
                      ? 'none yet'
                      : `${plural(scenarios.length, 'scenario')}: ${scenarios.map((one) => one.name).join(', ')}`}
                  </Text>
                </Table.Td>
                <Table.Td>
                  <Group gap="xs" justify="flex-end" wrap="nowrap">
                    {scenarios.length > 0 && (
                      <Button
                        component={Link}
                        to={evaluate([], [suiteOfOnesOwn(id)])}
                        size="xs"
                        variant="default"
                        aria-label={`Evaluate on ${name}`}
                      >
                        Evaluate
                      </Button>
                    )}
                    <DeleteButton name={name} onClick={() => setDeleted({ id, name })} />
                  </Group>
                </Table.Td>
              </Table.Tr>
            ))}
          </Table.Tbody>
        </Table>
      </Table.ScrollContainer>
      {deleted && (
        <DeleteDialog
          opened
          what={`“${deleted.name}”`}
          busy={remove.isPending}
          onClose={() => setDeleted(undefined)}
          onDelete={() =>
            remove.mutate(
              { params: { path: { suite_id: deleted.id } } },
              { onSettled: () => setDeleted(undefined) },
            )
          }
        >
          Which scenarios it has is forgotten; its arenas, and what was measured on them, stay.
        </DeleteDialog>
      )}
    </Panel>
  )
}
