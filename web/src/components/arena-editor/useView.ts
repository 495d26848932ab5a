/** Which part of the arena the drawing shows, and how many pixels a metre has there. */
import { useElementSize } from '@mantine/hooks'
import { useState } from 'react'
import type { Point } from './things'

/** Beside the walls, as a share of the longer side. */
const MARGIN = 0.04
const CLOSEST = 20
/** Pixels, where the browser has not said yet. */
const UNKNOWN = 600

/** Two fingers on the drawing: the place that is between them, metres, and how far apart they are, pixels. */
export interface Pinch {
  place: Point
  apart: number
  zoom: number
}

export function useView({ width, height }: { width: number; height: number }) {
  const { ref, width: wide, height: high } = useElementSize<HTMLDivElement>()
  const [zoom, setZoom] = useState(1)
  const [centre, setCentre] = useState<Point>({ x: 0, y: 0 })
  const margin = 2 * MARGIN * Math.max(width, height)
  const shown = { width: (width + margin) / zoom, height: (height + margin) / zoom }
  const scale = Math.min((wide || UNKNOWN) / shown.width, (high || UNKNOWN) / shown.height)
  const kept = ({ x, y }: Point): Point => ({
    x: Math.min(width / 2, Math.max(-width / 2, x)),
    y: Math.min(height / 2, Math.max(-height / 2, y)),
  })
  const at = zoom === 1 ? { x: 0, y: 0 } : kept(centre)
  return {
    ref,
    /** Metres of a pixel. */
    pixel: 1 / scale,
    centre: at,
    zoom,
    viewBox: `${at.x - shown.width / 2} ${-at.y - shown.height / 2} ${shown.width} ${shown.height}`,
    look: (to: Point) => setCentre(kept(to)),
    /** Shows what was between two fingers where they are now, as much larger as they are farther apart. */
    pinch: (from: Pinch, middle: Point, apart: number) => {
      const next = Math.min(CLOSEST, Math.max(1, (from.zoom * apart) / from.apart))
      // From the drawing's centre, in the pixels of the new zoom.
      const pixel = zoom / (scale * next)
      setCentre(kept({ x: from.place.x - middle.x * pixel, y: from.place.y + middle.y * pixel }))
      setZoom(next)
    },
    zoomBy: (factor: number) => {
      setCentre(at)
      setZoom(Math.min(CLOSEST, Math.max(1, zoom * factor)))
    },
  }
}

export type View = ReturnType<typeof useView>

/** Where a pointer is, metres. */
export function placeIn(
  svg: SVGSVGElement,
  { clientX, clientY }: { clientX: number; clientY: number },
): Point {
  const matrix = svg.getScreenCTM()
  if (!matrix) return { x: 0, y: 0 }
  return { x: (clientX - matrix.e) / matrix.a, y: -(clientY - matrix.f) / matrix.d }
}
