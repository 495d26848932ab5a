/** The look of a chart's line, to find it again in a legend or a table. */
import { useComputedColorScheme } from '@mantine/core'
import { colorOf, dashes, type Look, lineColor } from './palette'
import classes from './Swatch.module.css'

const [WIDTH, HEIGHT] = [20, 4]
/** So that two dashes are seen. */
const UNIT = 1.4

export function Swatch({ color, dash = 0 }: { color: number; dash?: number | undefined }) {
  const dark = useComputedColorScheme('light') === 'dark'
  return (
    <svg className={classes.swatch} width={WIDTH} height={HEIGHT} aria-hidden data-color={color}>
      <line
        x2={WIDTH}
        y1={HEIGHT / 2}
        y2={HEIGHT / 2}
        stroke={lineColor(color, dark)}
        strokeWidth={HEIGHT}
        strokeDasharray={dashes(dash, UNIT).join(' ')}
      />
    </svg>
  )
}

/** An experiment's, where it stands among those that it is drawn with, or by itself. */
export function ExperimentSwatch({ id, looks }: { id: string; looks?: ReadonlyMap<string, Look> }) {
  return <Swatch {...(looks?.get(id) ?? { color: colorOf(id) })} />
}
