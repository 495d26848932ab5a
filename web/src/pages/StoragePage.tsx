/** What takes how much of the disk, the largest first, and what may go of it. */
import { Anchor, Badge, Button, Group, Table, Text } from '@mantine/core'
import { useState } from 'react'
import { Link } from 'react-router'
import { $api } from '../api/client'
import type { StoredExperiment } from '../api/types'
import { Pager } from '../components/Pager'
import { Rows } from '../components/people/Rows'
import { RuleDialog } from '../components/storage/RuleDialog'
import { curveRuleInWords, ruleInWords } from '../components/storage/rules'
import { Notice, Page, Panel } from '../components/ui'
import ui from '../components/ui.module.css'
import { HEADS } from '../heads'
import { count, fileSize, plural } from '../lib/format'
import { useTitle } from '../lib/hooks'

const SIZE = 25

export function StoragePage() {
  useTitle(HEADS.StoragePage.title)
  const [page, setPage] = useState(1)
  const [chosen, choose] = useState<StoredExperiment | null>(null)
  const storage = $api.useQuery('get', '/api/storage', {
    params: { query: { limit: SIZE, offset: (page - 1) * SIZE } },
  })
  const data = storage.data
  return (
    <Page
      {...HEADS.StoragePage}
      below={
        // Its place is kept: two lines on a phone.
        <Text size="sm" c="dimmed" mih={{ base: '2lh', sm: '1lh' }}>
          {data && (
            <>
              Checkpoints take {fileSize(data.checkpoint_bytes)}
              {data.going_bytes > 0 && `, of which ${fileSize(data.going_bytes)} go by rules`};{' '}
              {fileSize(data.free_bytes)} are left on the server's disk.
            </>
          )}
        </Text>
      }
    >
      {data && data.free_bytes < data.min_free_bytes && (
        <Notice title="The disk is nearly full" bad role="alert">
          {fileSize(data.min_free_bytes)} should be left. Give the largest trainings a rule, and free what it
          takes at once.
        </Notice>
      )}
      <Panel flush>
        <Rows
          what="Trainings by size"
          head={['Training', 'Checkpoints', 'Size', 'Curves', 'Rule', '']}
          query={storage}
          empty="No checkpoints yet: they come with the first training."
          minWidth={640}
        >
          {data?.items.map((one) => (
            <Table.Tr key={one.id} data-testid="stored">
              <Table.Td>
                {one.in_trash ? (
                  <>
                    {one.name}{' '}
                    <Badge
                      size="sm"
                      variant="light"
                      color="gray"
                      miw="fit-content"
                      title="It goes as a whole"
                    >
                      In the trash
                    </Badge>
                  </>
                ) : (
                  <Anchor component={Link} to={`/experiments/${one.id}`} inherit>
                    {one.name}
                  </Anchor>
                )}
              </Table.Td>
              <Table.Td className={ui.number}>
                {count(one.checkpoints)}
                {one.going > 0 && (
                  <Text size="xs" c="dimmed">
                    {count(one.going)} go
                  </Text>
                )}
              </Table.Td>
              <Table.Td className={ui.number}>
                {fileSize(one.checkpoint_bytes)}
                {one.going > 0 && (
                  <Text size="xs" c="dimmed">
                    {fileSize(one.going_bytes)} go
                  </Text>
                )}
              </Table.Td>
              <Table.Td className={ui.number}>{fileSize(one.curve_bytes)}</Table.Td>
              <Table.Td>
                {ruleInWords(one.rule)}
                {!one.own_rule && (
                  <Text size="xs" c="dimmed">
                    of the installation
                  </Text>
                )}
                {curveRuleInWords(one.curve_rule) !== null && (
                  <Text size="xs">
                    {curveRuleInWords(one.curve_rule)}
                    {!one.own_curve_rule && ', of the installation'}
                  </Text>
                )}
              </Table.Td>
              <Table.Td>
                <Group justify="flex-end">
                  <Button
                    size="compact-sm"
                    variant="default"
                    disabled={one.in_trash}
                    aria-label={`Clean up ${one.name}`}
                    onClick={() => choose(one)}
                  >
                    Clean up
                  </Button>
                </Group>
              </Table.Td>
            </Table.Tr>
          ))}
        </Rows>
        <Pager
          page={page}
          size={SIZE}
          total={data?.total ?? 0}
          label="Pages of trainings"
          onChange={setPage}
        />
      </Panel>
      {data && chosen && (
        <RuleDialog
          key={chosen.id}
          experiment={data.items.find((one) => one.id === chosen.id) ?? chosen}
          days={data.keep_days}
          onClose={() => choose(null)}
        />
      )}
      {data && (
        <Text size="sm" c="dimmed" mt="md">
          What a rule takes is gone after {plural(data.keep_days, 'day')}; until then it can be kept after
          all.
        </Text>
      )}
    </Page>
  )
}
