/** An arena from above, drawn to scale: walls, obstacles, and where it has them ways of what moves, start and target. */
import type { ArenaGeometry } from '../api/types'
import { isRound, wayOf } from '../lib/arenas'
import classes from './ArenaDrawing.module.css'

interface ArenaDrawingProps {
  geometry: ArenaGeometry
  /** What a screen reader says instead of the drawing. */
  label: string
  /** What else is drawn over it, in metres, y upwards. */
  children?: React.ReactNode
}

/** How thick the outer wall is drawn, as a share of the longer side. */
const WALL = 0.012
/** Length of the arrow at the start, likewise. */
const ARROW = 0.05

export function ArenaDrawing({ geometry, label, children }: ArenaDrawingProps) {
  const { width, height } = geometry
  const unit = Math.max(width, height)
  const wall = unit * WALL
  return (
    <svg
      className={classes.drawing}
      viewBox={`${-width / 2 - wall} ${-height / 2 - wall} ${width + 2 * wall} ${height + 2 * wall}`}
      role="img"
      aria-label={label}
    >
      <rect
        className={classes.floor}
        x={-width / 2 - wall / 2}
        y={-height / 2 - wall / 2}
        width={width + wall}
        height={height + wall}
        strokeWidth={wall}
      />
      {/* Arenas count y upwards, drawings downwards. */}
      <g transform="scale(1,-1)">
        <ArenaShapes geometry={geometry} stroke={wall / 2} mark={(unit * ARROW) / 2} />
        {children}
      </g>
    </svg>
  )
}

interface ArenaShapesProps {
  geometry: ArenaGeometry
  /** How thick ways are drawn, metres. */
  stroke: number
  /** From the middle of start and target to their edges, metres. */
  mark: number
}

/** What stands in an arena and goes about in it, in metres, y upwards. */
export function ArenaShapes({ geometry, stroke, mark }: ArenaShapesProps) {
  const { circles, boxes, movers, start, target } = geometry
  return (
    <>
      <g className={classes.obstacles}>
        {circles.map(({ x, y, radius }, index) => (
          // biome-ignore lint/suspicious/noArrayIndexKey: an arena's obstacles stay in their order, and two may be alike.
          <circle key={index} cx={x} cy={y} r={radius} />
        ))}
        {boxes.map(({ x, y, length, width: across, angle }, index) => (
          <rect
            // biome-ignore lint/suspicious/noArrayIndexKey: likewise.
            key={index}
            x={-length / 2}
            y={-across / 2}
            width={length}
            height={across}
            transform={`translate(${x} ${y}) rotate(${angle})`}
          />
        ))}
      </g>
      {movers.map((mover, index) => {
        const way = wayOf(mover)
        const Line = isRound(mover) ? 'polygon' : 'polyline'
        return way.length > 0 ? (
          // biome-ignore lint/suspicious/noArrayIndexKey: likewise.
          <g key={index}>
            <Line
              className={classes.round}
              points={way.map(({ x, y }) => `${x},${y}`).join(' ')}
              strokeWidth={stroke}
              strokeDasharray={`${4 * stroke} ${3 * stroke}`}
            />
            <circle className={classes.mover} cx={way[0]?.x} cy={way[0]?.y} r={mover.radius} />
          </g>
        ) : null
      })}
      {start && (
        <path
          className={classes.start}
          d={`M${2 * mark} 0L${-mark} ${mark}L${-mark} ${-mark}Z`}
          transform={`translate(${start.x} ${start.y}) rotate(${start.heading})`}
        />
      )}
      {target && <circle className={classes.target} cx={target.x} cy={target.y} r={mark} />}
    </>
  )
}
