/** What leaves of an evaluation: its episodes as data, its figures as a table that one prints. */
import { Button, Menu } from '@mantine/core'
import { at } from '../../lib/base'
import { IconDownload } from '../icons'

const DATA = [
  { format: 'csv', label: 'CSV' },
  { format: 'json', label: 'JSON' },
] as const

const TABLES = [
  { format: 'latex', label: 'LaTeX (booktabs)' },
  { format: 'markdown', label: 'Markdown' },
] as const

export function EvaluationExport({ id }: { id: string }) {
  const item = ({ format, label }: (typeof DATA | typeof TABLES)[number]) => (
    <Menu.Item
      key={format}
      leftSection={<IconDownload size={16} />}
      component="a"
      href={at(`/api/evaluations/${id}/export?format=${format}`)}
      download
    >
      {label}
    </Menu.Item>
  )
  return (
    <Menu position="bottom-end" width={230}>
      <Menu.Target>
        <Button variant="default">Export</Button>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Label>Every episode</Menu.Label>
        {DATA.map(item)}
        <Menu.Label>Figures with N and intervals</Menu.Label>
        {TABLES.map(item)}
      </Menu.Dropdown>
    </Menu>
  )
}
