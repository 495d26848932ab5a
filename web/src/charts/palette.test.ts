import { expect, test } from 'vitest'
import { colorOf, DASHES, dashes, lineColor, looksOf } from './palette'

const COLORS = 12
/** Of charts, by scheme: --mapless-panel. */
const PANELS = { light: '#ffffff', dark: '#171b1f' }
/** WCAG 2.2, 1.4.11: what one has to see is 3:1 or more. */
const LEAST_CONTRAST = 3
/** Distances in OKLab; the eight of Okabe and Ito in dark enough shades came to 0.101, 0.001, 0.031 and 0.033. */
const LEAST = { all: 0.12, protan: 0.075, deutan: 0.075, tritan: 0.07 }
type Matrix = readonly (readonly [number, number, number])[]
/** Linear sRGB as those see it who lack one of the cones wholly (Machado, Oliveira and Fernandes 2009, table 1). */
const SEEN: Record<keyof typeof LEAST, Matrix> = {
  all: [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ],
  protan: [
    [0.152286, 1.052583, -0.204868],
    [0.114503, 0.786281, 0.099216],
    [-0.003882, -0.048116, 1.051998],
  ],
  deutan: [
    [0.367322, 0.860646, -0.227968],
    [0.280085, 0.672501, 0.047413],
    [-0.01182, 0.04294, 0.968881],
  ],
  tritan: [
    [1.255528, -0.076749, -0.178779],
    [-0.078411, 0.930809, 0.147602],
    [0.004733, 0.691367, 0.3039],
  ],
}
/** From linear sRGB to cones, and on from their cube roots (Ottosson 2020). */
const CONES: Matrix = [
  [0.4122214708, 0.5363325363, 0.0514459929],
  [0.2119034982, 0.6806995451, 0.1073969566],
  [0.0883024619, 0.2817188376, 0.6299787005],
]
const LAB: Matrix = [
  [0.2104542553, 0.793617785, -0.0040720468],
  [1.9779984951, -2.428592205, 0.4505937099],
  [0.0259040371, 0.7827717662, -0.808675766],
]

const times = (matrix: Matrix, [a = 0, b = 0, c = 0]: readonly number[]) =>
  matrix.map(([x, y, z]) => x * a + y * b + z * c)
const linear = (hex: string) =>
  [1, 3, 5].map((at) => {
    const value = Number.parseInt(hex.slice(at, at + 2), 16) / 255
    return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4
  })
const luminance = (hex: string) => {
  const [red = 0, green = 0, blue = 0] = linear(hex)
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue
}
const contrast = (one: string, other: string) => {
  const [low = 0, high = 0] = [luminance(one), luminance(other)].sort((a, b) => a - b)
  return (high + 0.05) / (low + 0.05)
}
const lab = (hex: string, seen: Matrix) => {
  const held = times(seen, linear(hex)).map((value) => Math.min(Math.max(value, 0), 1))
  return times(LAB, times(CONES, held).map(Math.cbrt))
}
const all = (dark: boolean) => Array.from({ length: COLORS }, (_, index) => lineColor(index, dark))

test.each(['light', 'dark'] as const)(
  'on %s panels every line is seen, and told from every other',
  (scheme) => {
    const colors = all(scheme === 'dark')
    expect(new Set(colors).size).toBe(COLORS)
    for (const color of colors) expect(contrast(color, PANELS[scheme])).toBeGreaterThanOrEqual(LEAST_CONTRAST)
    for (const who of Object.keys(LEAST) as (keyof typeof LEAST)[]) {
      const seen = colors.map((color) => lab(color, SEEN[who]))
      const apart = seen.flatMap((one, index) =>
        seen
          .slice(index + 1)
          .map((other) => Math.hypot(...one.map((value, axis) => value - (other[axis] ?? 0)))),
      )
      expect(Math.min(...apart), who).toBeGreaterThan(LEAST[who])
    }
  },
)

test('a colour is told by the id, as the server tells it', () => {
  expect(['a', 'k3v9x0m2p8q1', ''].map(colorOf)).toEqual([4, 7, 1])
  const counts = new Map<number, number>()
  for (let id = 0; id < 1200; id++) counts.set(colorOf(`${id}`), (counts.get(colorOf(`${id}`)) ?? 0) + 1)
  expect(counts.size).toBe(COLORS)
  expect(Math.max(...counts.values())).toBeLessThan(150)
})

test('drawn together, those of one colour have dashes of their own; the colour stays', () => {
  const ids = Array.from({ length: 200 }, (_, id) => `${id}`).filter((id) => colorOf(id) === colorOf('0'))
  const looks = looksOf([...ids.slice(0, 5), '0'])
  expect(ids.slice(0, 5).map((id) => looks.get(id))).toEqual(
    [0, 1, 2, 3, 0].map((dash) => ({ color: colorOf('0'), dash })),
  )
  expect(dashes(0, 2)).toEqual([])
  expect(dashes(1, 2)).toEqual(DASHES[1]?.map((length) => 2 * length))
})
