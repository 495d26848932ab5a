/** The drawing itself: the arena to scale, what is chosen with its handles, what was found wrong. */
import type { ArenaReview } from '../../api/types'
import { ArenaShapes } from '../ArenaDrawing'
import classes from './editor.module.css'
import { handlesOf } from './handles'
import { keyOf, wayOf } from './things'
import type { Tool } from './tools'
import { type GestureState, HANDLE_REACH, MARK } from './useGestures'
import type { View } from './useView'

/** Pixels: closer lines are a grey floor. */
const CLOSEST_LINES = 9
const HANDLE = 5
const REMARK = 9

interface CanvasProps {
  view: View
  tool: Tool
  grid: number
  gestures: GestureState
  remarks: ArenaReview['remarks']
  onKeyDown: (event: React.KeyboardEvent) => void
}

export function Canvas({ view, tool, grid, gestures, remarks, onKeyDown }: CanvasProps) {
  const { arena, chosen } = gestures.shown
  const { width, height } = arena
  const { pixel } = view
  const lines = [grid, 1, 5].find((step) => step > 0 && step / pixel >= CLOSEST_LINES)
  const handles = chosen ? handlesOf(arena, chosen, HANDLE_REACH * pixel) : []
  return (
    <div
      className={classes.canvas}
      ref={view.ref}
      role="application"
      aria-roledescription="drawing"
      aria-label="The arena from above"
      aria-describedby="editor-keys"
      // biome-ignore lint/a11y/noNoninteractiveTabindex: what takes arrow keys takes the focus.
      tabIndex={0}
      onKeyDown={onKeyDown}
    >
      <svg
        aria-hidden
        className={classes.drawing}
        data-tool={tool}
        data-testid="drawing"
        viewBox={view.viewBox}
        {...gestures.pointer}
      >
        {lines && (
          <pattern id="editor-grid" width={lines} height={lines} patternUnits="userSpaceOnUse">
            <path className={classes.line} d={`M0 0H${lines}M0 0V${lines}`} strokeWidth={pixel} />
          </pattern>
        )}
        <rect
          className={classes.floor}
          x={-width / 2 - 2 * pixel}
          y={-height / 2 - 2 * pixel}
          width={width + 4 * pixel}
          height={height + 4 * pixel}
          strokeWidth={4 * pixel}
        />
        {lines && (
          <rect
            x={-width / 2}
            y={-height / 2}
            width={width}
            height={height}
            fill="url(#editor-grid)"
            pointerEvents="none"
          />
        )}
        {/* Arenas count y upwards, drawings downwards. */}
        <g transform="scale(1,-1)">
          <ArenaShapes geometry={arena} stroke={2 * pixel} mark={MARK * pixel} />
          <Outline gestures={gestures} pixel={pixel} />
          {gestures.way.length > 0 && (
            <g className={classes.drawn}>
              <polyline
                points={gestures.way.map(({ x, y }) => `${x},${y}`).join(' ')}
                fill="none"
                strokeWidth={2 * pixel}
              />
              {gestures.way.map(({ x, y }, corner) => (
                // biome-ignore lint/suspicious/noArrayIndexKey: corners have no other identity.
                <circle key={corner} cx={x} cy={y} r={3 * pixel} />
              ))}
            </g>
          )}
          {handles.map(({ name, x, y }) => (
            <circle
              key={name}
              className={classes.handle}
              data-handle={name}
              data-turns={name === 'turn' || undefined}
              cx={x}
              cy={y}
              r={HANDLE * pixel}
              strokeWidth={1.5 * pixel}
            />
          ))}
        </g>
        {remarks.map(({ x, y, refused }, index) => (
          // biome-ignore lint/suspicious/noArrayIndexKey: remarks are numbered.
          <g key={index} className={classes.remark} data-refused={refused} pointerEvents="none">
            <circle cx={x} cy={-y} r={REMARK * pixel} />
            <text x={x} y={-y} dy="0.35em" fontSize={12 * pixel} textAnchor="middle">
              {index + 1}
            </text>
          </g>
        ))}
      </svg>
    </div>
  )
}

/** The edge of what is chosen. */
function Outline({ gestures, pixel }: { gestures: GestureState; pixel: number }) {
  const { arena, chosen } = gestures.shown
  if (!chosen) return null
  const circle = chosen.part === 'circles' ? arena.circles[chosen.index] : undefined
  const box = chosen.part === 'boxes' ? arena.boxes[chosen.index] : undefined
  const mover = chosen.part === 'movers' ? arena.movers[chosen.index] : undefined
  const first = mover && wayOf(mover)[0]
  const mark = chosen.part === 'start' || chosen.part === 'target' ? arena[chosen.part] : null
  const round =
    circle ??
    (first && mover ? { ...first, radius: mover.radius } : mark && { ...mark, radius: MARK * pixel })
  return (
    <g className={classes.outline} strokeWidth={2 * pixel} data-chosen={keyOf(chosen)}>
      {round && <circle cx={round.x} cy={round.y} r={round.radius + 2 * pixel} />}
      {box && (
        <rect
          x={-box.length / 2}
          y={-box.width / 2}
          width={box.length}
          height={box.width}
          transform={`translate(${box.x} ${box.y}) rotate(${box.angle ?? 0})`}
        />
      )}
    </g>
  )
}
