/**
 * Line colours that people with any colour vision tell apart, for both schemes: as far from one another as twelve can be, seen by all
 * and without red, green or blue, and 3:1 or more on the panels. An experiment's is told by its id, here as in the server's printing.
 */
const LIGHT = [
  '#2a55d5',
  '#cf7d09',
  '#6ea065',
  '#6e1972',
  '#7f6c0c',
  '#2b99ee',
  '#470eae',
  '#3d3d3d',
  '#cb3565',
  '#258b94',
  '#2f5d1e',
  '#695197',
]
const DARK = [
  '#0180d2',
  '#e8a685',
  '#93fd9c',
  '#8c6298',
  '#9f920a',
  '#5ea5ca',
  '#988bfc',
  '#e8e8e8',
  '#c14442',
  '#24d0c1',
  '#aaca13',
  '#eab8fd',
]
/** Lengths of dash and gap, in widths of the line; the first is drawn through. */
export const DASHES: readonly (readonly number[])[] = [[], [6, 3], [2, 2], [8, 2, 2, 2]]

const FNV_START = 0x811c9dc5
const FNV_PRIME = 0x01000193

/** How a line looks. */
export interface Look {
  /** Index into the palette. */
  color: number
  /** Index into the dashes. */
  dash: number
}

/** The colour of the `index`-th line; after twelve they repeat. */
export function lineColor(index: number, dark: boolean): string {
  const colors = dark ? DARK : LIGHT
  return colors[index % colors.length] ?? '#888888'
}

/** The dashes of a line of this width, in pixels. */
export const dashes = (dash: number, width: number): number[] =>
  (DASHES[dash % DASHES.length] ?? []).map((length) => length * width)

/** The colour that stays with an experiment, wherever it is drawn: FNV-1a of its id. */
export function colorOf(id: string): number {
  let hash = FNV_START
  for (const letter of id) hash = Math.imul(hash ^ (letter.codePointAt(0) ?? 0), FNV_PRIME)
  return (hash >>> 0) % LIGHT.length
}

/** The looks of experiments that are drawn together, in order: of those of one colour the second is dashed, and so on. */
export function looksOf(ids: readonly string[]): ReadonlyMap<string, Look> {
  const looks = new Map<string, Look>()
  const drawn = new Array<number>(LIGHT.length).fill(0)
  for (const id of ids) {
    if (looks.has(id)) continue
    const color = colorOf(id)
    const dash = drawn[color] ?? 0
    drawn[color] = dash + 1
    looks.set(id, { color, dash: dash % DASHES.length })
  }
  return looks
}
