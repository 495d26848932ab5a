/** What leaves of a comparison: a table as one would print it, everything as a report or a link. */
import { ActionIcon, Button, CopyButton, Menu } from '@mantine/core'
import { lookOf, MOST_PANELS, USUAL_PANELS } from '../charts/panels'
import { type ChartView, smoothText, zoomText } from '../charts/view'
import { at } from '../lib/base'
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
            href={at(`/api/compare/table?${query}&table=${table}&format=${format}`)}
            download
          >
            {label}
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  )
}

const DATA = [
  { format: 'csv', label: 'Figures and curves, CSV' },
  { format: 'parquet', label: 'Figures and curves, Parquet' },
  { format: 'json', label: 'Figures and curves, JSON' },
]

interface WholeExportProps {
  query: string
  /** How its curves are looked at. */
  view: ChartView
  /** What is compared, and the margin, as the API takes it. */
  data: string
}

/** The whole comparison: a file of its own, its data, and the address of this page. */
export function WholeExport({ query, view, data }: WholeExportProps) {
  return (
    <>
      <CopyButton value={window.location.href}>
        {({ copied, copy }) => (
          <Button variant="default" onClick={copy}>
            {copied ? 'Link copied' : 'Copy link'}
          </Button>
        )}
      </CopyButton>
      <Button
        component="a"
        variant="default"
        href={at(`/api/compare/report?${query}${lookOfReport(view)}`)}
        download
      >
        Report (HTML)
      </Button>
      <Menu position="bottom-end" width={230}>
        <Menu.Target>
          <Button variant="default">Export data</Button>
        </Menu.Target>
        <Menu.Dropdown>
          {DATA.map(({ format, label }) => (
            <Menu.Item
              key={format}
              leftSection={<IconDownload size={16} />}
              component="a"
              href={at(`/api/compare/export?${data}&format=${format}`)}
              download
            >
              {label}
            </Menu.Item>
          ))}
        </Menu.Dropdown>
      </Menu>
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

/** What a report is told of how curves are looked at, after another query; nothing where that is as usual. */
function lookOfReport({ across, logX, logY, panels, smooth, hidden, zoom }: ChartView): string {
  const query = new URLSearchParams((panels ?? []).map((name) => ['name', name]))
  if (across !== 'steps') query.set('x', across)
  if (logX) query.set('log', 'true')
  for (const name of logY.slice(0, MOST_PANELS)) query.append('ylog', name)
  for (const name of panels ?? USUAL_PANELS) {
    const strength = smooth[name]
    if (strength !== undefined && lookOf(name).smoothable) query.append('smooth', smoothText(name, strength))
  }
  for (const key of hidden) query.append('hide', key)
  if (zoom) query.set('zoom', zoomText(zoom))
  return query.size > 0 ? `&${query}` : ''
}
