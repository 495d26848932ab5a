/** A recording from above: what the LiDAR met, the robot's way, its goals, and one moment of it all. */
import { useComputedColorScheme } from '@mantine/core'
import { useMemo } from 'react'
import { lineColor } from '../../charts/palette'
import { arcOf, type Beside, placeAt, type Reading } from './reading'
import classes from './recordings.module.css'

interface SceneProps {
  reading: Reading
  beside: Beside | undefined
  /** Seconds. */
  time: number
  onSeek: (seconds: number) => void
}

export function Scene({ reading, beside, time, onSeek }: SceneProps) {
  const dark = useComputedColorScheme('light') === 'dark'
  const box = useMemo(() => boxOf(reading), [reading])
  const dots = useMemo(() => reading.points.map(([x, y]) => `M${x} ${y}h0`).join(''), [reading])
  const way = useMemo(() => reading.path.map(([x, y]) => `${x},${y}`).join(' '), [reading])
  const unit = Math.max(box.width, box.height)
  const pose = reading.path[placeAt(reading.times, time)] ?? [0, 0, 0]
  const [x, y, heading] = pose
  const rays = useMemo(() => raysOf(reading, time), [reading, time])
  const at = beside ? placeAt(beside.times, time) : 0
  const goal = [...reading.goals].reverse().find(([from]) => from <= time) ?? reading.goals[0]
  const thick = unit / 220
  const line = (points: readonly (readonly [number, number])[]) =>
    points.map(([px, py]) => `${px},${py}`).join(' ')
  return (
    <svg
      className={classes.scene}
      viewBox={`${box.left} ${-box.top} ${box.width} ${box.height}`}
      role="img"
      aria-label="The robot's way among what its LiDAR met, from above"
      data-testid="scene"
    >
      {/* Recordings count y upwards, drawings downwards. */}
      <g transform="scale(1,-1)">
        <path className={classes.dots} d={dots} strokeWidth={unit / 260} />
        <path
          className={classes.rays}
          d={rays}
          strokeWidth={unit / 900}
          transform={`translate(${x} ${y}) rotate(${(heading * 180) / Math.PI})`}
        />
        <polyline
          className={classes.way}
          points={way}
          strokeWidth={thick}
          style={{ stroke: lineColor(0, dark) }}
        />
        {reading.goals.map(([from, gx, gy]) => (
          <circle
            key={`${from} ${gx} ${gy}`}
            className={classes.goal}
            cx={gx}
            cy={gy}
            r={unit / 70}
            strokeWidth={thick}
            data-now={goal?.[0] === from}
          >
            <title>Goal</title>
          </circle>
        ))}
        {beside?.partings.map((parting) => {
          const [px, py] = reading.path[placeAt(reading.times, parting.at)] ?? [0, 0]
          return (
            // biome-ignore lint/a11y/noStaticElementInteractions: the list beside does the same by keyboard.
            <circle
              key={parting.at}
              className={classes.parting}
              cx={px}
              cy={py}
              r={unit / 90}
              strokeWidth={thick}
              onClick={() => onSeek(parting.at)}
            >
              <title>{`Parted at ${parting.at.toFixed(1)} s`}</title>
            </circle>
          )
        })}
        {beside && (
          <>
            <polyline
              className={classes.arc}
              points={line(arcOf(pose, beside.did_forwards[at] ?? 0, beside.did_turning[at] ?? 0))}
              strokeWidth={2 * thick}
              style={{ stroke: lineColor(0, dark) }}
            />
            <polyline
              className={classes.arc}
              points={line(arcOf(pose, beside.forwards[at] ?? 0, beside.turning[at] ?? 0))}
              strokeWidth={2 * thick}
              style={{ stroke: lineColor(1, dark) }}
            />
          </>
        )}
        <path
          className={classes.robot}
          d={`M${unit / 45} 0L${-unit / 70} ${unit / 80}L${-unit / 70} ${-unit / 80}Z`}
          transform={`translate(${x} ${y}) rotate(${(heading * 180) / Math.PI})`}
        />
      </g>
    </svg>
  )
}

/** All that is drawn, with a margin. */
function boxOf(reading: Reading) {
  const xs = [
    ...reading.points.map(([x]) => x),
    ...reading.path.map(([x]) => x),
    ...reading.goals.map(([, x]) => x),
  ]
  const ys = [
    ...reading.points.map(([, y]) => y),
    ...reading.path.map(([, y]) => y),
    ...reading.goals.map(([, , y]) => y),
  ]
  const least = (all: readonly number[]) => all.reduce((a, b) => Math.min(a, b), Number.POSITIVE_INFINITY)
  const most = (all: readonly number[]) => all.reduce((a, b) => Math.max(a, b), Number.NEGATIVE_INFINITY)
  const [left, right, bottom, top] = [least(xs), most(xs), least(ys), most(ys)]
  const margin = 0.3 + 0.03 * Math.max(right - left, top - bottom)
  return {
    left: left - margin,
    top: top + margin,
    width: right - left + 2 * margin,
    height: top - bottom + 2 * margin,
  }
}

/** The scan of a moment, in the robot's frame. */
function raysOf(reading: Reading, time: number): string {
  const ranges = reading.scans[placeAt(reading.scan_times, time)] ?? []
  const [ax, ay] = reading.lidar_at
  return ranges
    .map((range, index) => {
      if (range === null) return ''
      const bearing = reading.scan_bearings[index] ?? 0
      return `M${ax} ${ay}l${(range * Math.cos(bearing)).toFixed(2)} ${(range * Math.sin(bearing)).toFixed(2)}`
    })
    .join('')
}
