/** Lines across several axes, one for each of what is compared: which values went together. */
import type { Axis } from './axis'
import classes from './Scatter.module.css'

interface ParallelCoordinatesProps {
  label: string
  axes: readonly { title: string; axis: Axis }[]
  /** One value for each axis, and how good it was, 0 to 1. */
  lines: readonly { key: string; values: readonly unknown[]; merit: number; best: boolean; title: string }[]
  onOpen?: (key: string) => void
}

const [WIDTH, HEIGHT] = [900, 280]
const [LEFT, TOP, RIGHT, BOTTOM] = [60, 34, 60, 14]
/** Of titles, so that they don't run into one another. */
const LETTER = 6

export function ParallelCoordinates({ label, axes, lines, onOpen }: ParallelCoordinatesProps) {
  const gap = axes.length > 1 ? (WIDTH - LEFT - RIGHT) / (axes.length - 1) : 0
  const across = (index: number) => LEFT + index * gap
  const up = (at: number) => HEIGHT - BOTTOM - at * (HEIGHT - TOP - BOTTOM)
  const letters = Math.max(6, Math.floor(Math.max(gap, 60) / LETTER) - 1)
  return (
    <svg
      className={classes.frame}
      viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
      role="img"
      aria-label={label}
      data-testid="parallel"
    >
      {[...lines]
        .sort((a, b) => a.merit - b.merit)
        .map(({ key, values, merit, best, title }) => (
          // biome-ignore lint/a11y/noStaticElementInteractions: the table of trials opens the same by keyboard.
          <polyline
            key={key}
            className={classes.way}
            data-best={best || undefined}
            stroke={`color-mix(in oklab, var(--mantine-primary-color-filled) ${Math.round(merit * 100)}%, var(--mantine-color-gray-5))`}
            strokeWidth={1.5}
            points={values
              .map((value, index) => `${across(index)},${up(axes[index]?.axis.place(value) ?? 0)}`)
              .join(' ')}
            onClick={() => onOpen?.(key)}
          >
            <title>{title}</title>
          </polyline>
        ))}
      {axes.map(({ title, axis }, index) => {
        const anchor = index === 0 ? 'start' : index === axes.length - 1 ? 'end' : 'middle'
        const side = index === axes.length - 1 ? 1 : -1
        return (
          <g key={title}>
            <line className={classes.grid} x1={across(index)} x2={across(index)} y1={up(0)} y2={up(1)} />
            <text
              x={across(index) + (index === 0 ? -LEFT + 4 : index === axes.length - 1 ? RIGHT - 4 : 0)}
              y={16}
              textAnchor={anchor}
            >
              {title.length > letters ? `${title.slice(0, letters - 1)}…` : title}
              <title>{title}</title>
            </text>
            {axis.ticks.map(({ at, label: text }) => (
              <text
                key={`${at} ${text}`}
                className={classes.halo}
                x={across(index) + side * 6}
                y={up(at) + 4}
                textAnchor={side === 1 ? 'start' : 'end'}
              >
                {text}
              </text>
            ))}
          </g>
        )
      })}
    </svg>
  )
}
