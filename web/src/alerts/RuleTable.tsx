/** One's rules: switched on and off, tried, deleted. */
import { Button, Group, Switch, Table } from '@mantine/core'
import { $api } from '../api/client'
import { Rows } from '../components/people/Rows'
import { useChange } from '../components/people/useChange'
import { ruleInWords, targetInWords } from './wording'

export function RuleTable() {
  const settle = useChange()
  const rules = $api.useQuery('get', '/api/alerts/rules', { params: { query: { limit: 50 } } })
  const edit = $api.useMutation('patch', '/api/alerts/rules/{rule_id}', settle('change the rule'))
  const remove = $api.useMutation('delete', '/api/alerts/rules/{rule_id}', settle('delete the rule'))
  const test = $api.useMutation('post', '/api/alerts/rules/{rule_id}/test', settle('try the rule'))
  return (
    <Rows
      what="Rules"
      head={['When', 'In', 'To', 'On', '']}
      query={rules}
      empty="No rules yet: add one above, and be told."
    >
      {rules.data?.items.map((rule) => {
        const of = { params: { path: { rule_id: rule.id } } }
        const name = ruleInWords(rule)
        return (
          <Table.Tr key={rule.id} data-testid="rule">
            <Table.Td>{name}</Table.Td>
            <Table.Td>{rule.project ?? (rule.event === 'disk' ? '' : 'every project')}</Table.Td>
            <Table.Td style={{ overflowWrap: 'anywhere' }}>{targetInWords(rule)}</Table.Td>
            <Table.Td>
              <Switch
                aria-label={`${name}: on`}
                checked={rule.enabled}
                onChange={(event) => edit.mutate({ ...of, body: { enabled: event.currentTarget.checked } })}
              />
            </Table.Td>
            <Table.Td>
              <Group gap={6} wrap="nowrap" justify="end">
                <Button size="compact-xs" variant="default" onClick={() => test.mutate(of)}>
                  Send a test
                </Button>
                <Button
                  size="compact-xs"
                  variant="subtle"
                  color="red"
                  aria-label={`Delete: ${name}`}
                  onClick={() => remove.mutate(of)}
                >
                  Delete
                </Button>
              </Group>
            </Table.Td>
          </Table.Tr>
        )
      })}
    </Rows>
  )
}
