/** Where collisions are dense. */

/** Side of a square that collisions are counted in, metres. */
const SIZE = 0.5

export interface Cell {
  /** Of its corner with the lowest x and y, metres. */
  x: number
  y: number
  size: number
  /** Its collisions over those of the fullest square, 0 to 1. */
  share: number
}

/** The squares in which any of these points lie. */
export function collisionCells(points: readonly (readonly number[])[]): Cell[] {
  const counts = new Map<string, { x: number; y: number; many: number }>()
  for (const [px = 0, py = 0] of points) {
    const x = Math.floor(px / SIZE) * SIZE
    const y = Math.floor(py / SIZE) * SIZE
    const cell = counts.get(`${x} ${y}`) ?? { x, y, many: 0 }
    cell.many += 1
    counts.set(`${x} ${y}`, cell)
  }
  const cells = [...counts.values()]
  const most = Math.max(1, ...cells.map(({ many }) => many))
  return cells.map(({ x, y, many }) => ({ x, y, size: SIZE, share: many / most }))
}
