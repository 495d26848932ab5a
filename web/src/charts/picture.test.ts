import { expect, test } from 'vitest'
import { ACROSS } from './across'
import { csvOf, heightOf, svgOf } from './picture'
import type { ChartData } from './series'

const text = (value: number) => String(value)
const look = {
  title: 'Success <rate>',
  x: { title: 'Steps', format: text },
  y: 'Share of <all>',
  format: text,
}

const data: ChartData = {
  x: [0, 100],
  lines: [
    { key: 'a:0', name: 'One, seed 0', color: 0, thin: true, values: [0.5, null] },
    { key: 'a', label: '=One, 2 seeds', color: 0, values: [0, 1], band: { low: [0, 0.5], high: [0.5, 1] } },
  ],
}

test('a chart as CSV: a column for each line and the ends of its band, and no cell a formula', () => {
  expect(csvOf(data, look.x)).toBe(
    '"Steps","One, seed 0","\'=One, 2 seeds","\'=One, 2 seeds, low","\'=One, 2 seeds, high"\r\n0,0.5,0,0,0.5\r\n100,,1,0.5,1\r\n',
  )
})

test('a chart as SVG: lines, bands, a single point as a dot, axes and legend', () => {
  // From 70 to 704 across, from 312 up to 36.
  const svg = svgOf(data, { ...look, yRange: [0, 1] })
  expect(svg).toContain('<polyline points="70.0,312.0 704.0,36.0"')
  expect(svg).toContain('<polygon points="70.0,174.0 704.0,36.0 704.0,174.0 70.0,312.0"')
  expect(svg).toContain('<circle cx="70.0" cy="174.0"')
  expect(svg).toContain('Success &lt;rate&gt;')
  expect(svg).toContain('>Steps</text>')
  // Upright, in the middle of the axis; the ticks with as many decimals.
  expect(svg).toContain(
    '<text transform="translate(16 174) rotate(-90)" text-anchor="middle" fill="#3d464d">Share of &lt;all&gt;</text>',
  )
  for (const tick of ['0.0', '0.2', '0.8', '1.0']) expect(svg).toContain(`>${tick}</text>`)
  expect(svg).toContain('=One, 2 seeds</text>')
  expect(new DOMParser().parseFromString(svg, 'image/svg+xml').querySelector('parsererror')).toBeNull()
  expect(svg).toContain(`height="${heightOf(data)}"`)
})

test('a picture of smoothed curves says so', () => {
  expect(svgOf(data, { ...look, note: 'smoothed, 0.80' })).toContain(' · smoothed, 0.80</tspan>')
})

test('over time the numbers are seconds, and the picture has hours', () => {
  const overNoon = { ...data, x: [0, 7_200] }
  expect(csvOf(overNoon, ACROSS.wall)).toMatch(/^"Time under way, seconds",.*\r\n0,.*\r\n7200,/)
  const svg = svgOf(overNoon, { ...look, x: ACROSS.wall })
  for (const tick of ['0 s', '30 min', '1 h', '1 h 30 min', '2 h']) expect(svg).toContain(`>${tick}</text>`)
})

test('a logarithmic axis has powers of ten', () => {
  const values = { key: 'a', label: 'loss', color: 0, values: [0.01, 10] }
  const svg = svgOf({ x: [0, 1], lines: [values] }, { ...look, logarithmic: true })
  for (const power of ['0.01', '0.1', '1', '10']) expect(svg).toContain(`>${power}</text>`)
})

test('with a value at 0 the picture stays linear, as the chart on the page does', () => {
  const values = { key: 'a', label: 'loss', color: 0, values: [0, 10] }
  const chart = { x: [0, 1], lines: [values] }
  expect(svgOf(chart, { ...look, logarithmic: true })).toBe(svgOf(chart, look))
})

test('a logarithmic x begins above 0: a tenth of the way is half of two decades', () => {
  const values = { key: 'a', label: 'loss', color: 0, values: [9, 1, 2, 3] }
  const svg = svgOf({ x: [0, 1, 10, 100], lines: [values] }, { ...look, yRange: [1, 3], logX: true })
  expect(svg).toContain('<polyline points="70.0,312.0 387.0,174.0 704.0,36.0"')
  for (const power of ['1', '10', '100']) expect(svg).toContain(`>${power}</text>`)
})

test('a name that is longer than the axis ends in time', () => {
  const svg = svgOf(data, { ...look, y: 'a'.repeat(64) })
  expect(svg).toContain(`>${'a'.repeat(39)}…</text>`)
})
