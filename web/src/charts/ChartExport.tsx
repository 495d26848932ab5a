/** The menu beside a chart: what it shows as CSV, SVG or PNG. */
import { ActionIcon, Menu } from '@mantine/core'
import { IconDownload } from '../components/icons'
import { csvOf, heightOf, type PictureOptions, svgOf, WIDTH } from './picture'
import { savePng, saveText } from './save'
import type { ChartData } from './series'

interface ChartExportProps extends PictureOptions {
  data: ChartData
  /** The same, as it was reported. */
  numbers: ChartData
}

export function ChartExport({ data, numbers, ...options }: ChartExportProps) {
  const { title, x } = options
  const name = `mapless-${title.toLowerCase().replace(/[^a-z0-9]+/g, '-')}`
  return (
    <Menu position="bottom-end">
      <Menu.Target>
        <ActionIcon variant="subtle" color="gray" size="sm" aria-label={`Export the chart ${title}`}>
          <IconDownload size={16} stroke={1.6} />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Item onClick={() => saveText(`${name}.csv`, 'text/csv', csvOf(numbers, x))}>
          Numbers (CSV)
        </Menu.Item>
        <Menu.Item onClick={() => saveText(`${name}.svg`, 'image/svg+xml', svgOf(data, options))}>
          Picture (SVG)
        </Menu.Item>
        <Menu.Item onClick={() => savePng(`${name}.png`, svgOf(data, options), WIDTH, heightOf(data))}>
          Picture (PNG)
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  )
}
