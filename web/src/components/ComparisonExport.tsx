/** What leaves of a comparison: a table as one would print it, everything as a report or a link. */
import { ActionIcon, Button, CopyButton, Menu } from '@mantine/core'
import { IconDownload } from './icons'

type Table = 'figures' | 'verdicts' | 'improvements' | 'differences'

const FORMATS = [
  { format: 'latex', label: 'LaTeX (booktabs)' },
  { format: 'markdown', label: 'Markdown' },
  { format: 'csv', label: 'CSV' },
] as const

interface TableExportProps {
  table: Table
  /** As the table is called on the page. */
  title: string
  /** What is compared, and how, as the API takes it. */
  query: string
}

/** The menu beside a table. */
export function TableExport({ table, title, query }: TableExportProps) {
  return (
    <Menu position="bottom-end">
      <Menu.Target>
        <ActionIcon variant="subtle" color="gray" aria-label={`Export the table ${title}`}>
          <IconDownload size={18} stroke={1.6} />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown>
        {FORMATS.map(({ format, label }) => (
          <Menu.Item
            key={format}
            component="a"
            href={`/api/compare/table?${query}&table=${table}&format=${format}`}
            download
          >
            {label}
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  )
}

/** The whole comparison: a file of its own, and the address of this page. */
export function WholeExport({ query }: { query: string }) {
  return (
    <>
      <CopyButton value={window.location.href}>
        {({ copied, copy }) => (
          <Button variant="default" onClick={copy}>
            {copied ? 'Link copied' : 'Copy link'}
          </Button>
        )}
      </CopyButton>
      <Button component="a" variant="default" href={`/api/compare/report?${query}`} download>
        Report (HTML)
      </Button>
    </>
  )
}

/** What is compared, and how, as the API takes it. */
export function comparisonQuery(
  experiments: readonly string[],
  margin: number,
  held: { base?: string; pairs?: boolean },
): string {
  const query = new URLSearchParams(experiments.map((id) => ['experiment', id]))
  query.set('margin', String(margin))
  for (const [name, value] of Object.entries(held)) query.set(name, String(value))
  return query.toString()
}
