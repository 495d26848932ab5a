/** An arena from above, drawn to scale: walls, obstacles, and where it has them ways of what moves, start and target. */
import type { ArenaGeometry } from '../api/types'
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

/** Where a mover goes, as far as the arena says: a patrol's corners, or a timed one's places in order. */
function wayOf(mover: ArenaGeometry['movers'][number]): readonly { x: number; y: number }[] {
  if (mover.kind === 'patrol') return mover.waypoints
  return mover.kind === 'timed' ? mover.keyframes : []
}

export function ArenaDrawing({ geometry, label, children }: ArenaDrawingProps) {
  const { width, height, circles, boxes, movers, start, target } = geometry
  const unit = Math.max(width, height)
  const wall = unit * WALL
  const arrow = unit * ARROW
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
        <g className={classes.obstacles}>
          {circles.map(({ x, y, radius }) => (
            <circle key={`${x} ${y} ${radius}`} cx={x} cy={y} r={radius} />
          ))}
          {boxes.map(({ x, y, length, width: across, angle }) => (
            <rect
              key={`${x} ${y} ${length} ${across} ${angle}`}
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
          const Line = mover.kind === 'timed' ? 'polyline' : 'polygon'
          return way.length > 0 ? (
            // biome-ignore lint/suspicious/noArrayIndexKey: an arena's movers stay in their order, and two may be alike.
            <g key={index}>
              <Line
                className={classes.round}
                points={way.map(({ x, y }) => `${x},${y}`).join(' ')}
                strokeWidth={wall / 2}
                strokeDasharray={`${2 * wall} ${1.5 * wall}`}
              />
              <circle className={classes.mover} cx={way[0]?.x} cy={way[0]?.y} r={mover.radius} />
            </g>
          ) : null
        })}
        {start && (
          <path
            className={classes.start}
            d={`M${arrow} 0L${-arrow / 2} ${arrow / 2}L${-arrow / 2} ${-arrow / 2}Z`}
            transform={`translate(${start.x} ${start.y}) rotate(${start.heading})`}
          />
        )}
        {target && <circle className={classes.target} cx={target.x} cy={target.y} r={arrow / 2} />}
        {children}
      </g>
    </svg>
  )
}
