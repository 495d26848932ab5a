/** Points over two axes, such as trials of a study; one that leads somewhere is clicked. */
import { useComputedColorScheme } from '@mantine/core'
import type { Axis } from './axis'
import { lineColor } from './palette'
import classes from './Scatter.module.css'

export interface Point {
  key: string
  x: unknown
  y: unknown
  /** Of the palette; null for what is there but does not count. */
  color: number | null
  /** Whether it stands out. */
  large?: boolean
  title: string
}

interface ScatterProps {
  label: string
  x: Axis
  y: Axis
  xTitle: string
  yTitle: string
  points: readonly Point[]
  /** A line through values, in order. */
  line?: readonly (readonly [unknown, unknown])[]
  onOpen?: (key: string) => void
}

const [WIDTH, HEIGHT] = [440, 230]
const [LEFT, TOP, RIGHT, BOTTOM] = [60, 12, 14, 42]
const [RADIUS, LARGE] = [4, 6.5]
const QUIET = 'var(--mantine-color-gray-5)'

export function Scatter({ label, x, y, xTitle, yTitle, points, line, onOpen }: ScatterProps) {
  const dark = useComputedColorScheme('light') === 'dark'
  const left = (value: unknown) => LEFT + x.place(value) * (WIDTH - LEFT - RIGHT)
  const top = (value: unknown) => HEIGHT - BOTTOM - y.place(value) * (HEIGHT - TOP - BOTTOM)
  const across = (at: number) => LEFT + at * (WIDTH - LEFT - RIGHT)
  const up = (at: number) => HEIGHT - BOTTOM - at * (HEIGHT - TOP - BOTTOM)
  return (
    <svg
      className={classes.frame}
      viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
      role="img"
      aria-label={label}
      data-testid="scatter"
    >
      {y.ticks.map(({ at, label: text }) => (
        <g key={`${at} ${text}`}>
          <line className={classes.grid} x1={LEFT} x2={WIDTH - RIGHT} y1={up(at)} y2={up(at)} />
          <text x={LEFT - 6} y={up(at) + 4} textAnchor="end">
            {text}
          </text>
        </g>
      ))}
      {x.ticks.map(({ at, label: text }) => (
        <text key={`${at} ${text}`} x={across(at)} y={HEIGHT - BOTTOM + 16} textAnchor="middle">
          {text}
        </text>
      ))}
      <text x={(LEFT + WIDTH - RIGHT) / 2} y={HEIGHT - 6} textAnchor="middle">
        {xTitle}
      </text>
      <text transform={`translate(10 ${(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)`} textAnchor="middle">
        {yTitle}
      </text>
      {line && line.length > 1 && (
        <polyline className={classes.line} points={line.map(([a, b]) => `${left(a)},${top(b)}`).join(' ')} />
      )}
      {points.map((point) => (
        // biome-ignore lint/a11y/noStaticElementInteractions: the table of trials opens the same by keyboard.
        <circle
          key={point.key}
          className={classes.point}
          data-link={onOpen ? true : undefined}
          cx={left(point.x)}
          cy={top(point.y)}
          r={point.large ? LARGE : RADIUS}
          fill={point.color === null ? QUIET : lineColor(point.color, dark)}
          onClick={() => onOpen?.(point.key)}
        >
          <title>{point.title}</title>
        </circle>
      ))}
    </svg>
  )
}
