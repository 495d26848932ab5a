/** What stands in a playground, by name, with the numbers that say where; and the change that puts it elsewhere. */
import type { Playground, PlaygroundChange } from '../../api/types'

type Thing = NonNullable<Playground['chosen']['thing']>

export interface Chosen {
  thing: Thing
  index: number
}

export interface Field {
  name: string
  label: string
  value: number
  step: number
  min?: number
}

/** "circle:2"; "" for nothing. */
export const keyOf = (chosen: Playground['chosen']): string =>
  chosen.thing ? `${chosen.thing}:${chosen.index ?? 0}` : ''

export function chosenOf(key: string): Chosen | null {
  const [thing, index] = key.split(':')
  return key === '' ? null : { thing: thing as Thing, index: Number(index) }
}

export function thingsIn({ geometry, movers }: Playground): { value: string; label: string }[] {
  const some = (thing: Thing, name: string, things: readonly unknown[]) =>
    things.map((_, index) => ({ value: `${thing}:${index}`, label: `${name} ${index + 1}` }))
  return [
    { value: 'robot:0', label: 'Robot' },
    { value: 'target:0', label: 'Target' },
    ...some('mover', 'Moving', movers),
    ...some('circle', 'Disc', geometry.circles ?? []),
    ...some('box', 'Box', geometry.boxes ?? []),
  ]
}

const metres = (name: string, label: string, value: number, min?: number): Field => ({
  name,
  label,
  value,
  step: 0.1,
  ...(min === undefined ? {} : { min }),
})
const degrees = (name: string, label: string, value: number): Field => ({ name, label, value, step: 15 })

/** Where a thing is; null where it is not there (any more). */
export function fieldsOf(ground: Playground, { thing, index }: Chosen): Field[] | null {
  const at = (place: { x: number; y: number } | undefined | null) =>
    place ? [metres('x', 'x, m', place.x), metres('y', 'y, m', place.y)] : null
  const circle = ground.geometry.circles?.[index]
  const box = ground.geometry.boxes?.[index]
  switch (thing) {
    case 'robot':
      return (
        ground.robot && [...(at(ground.robot) ?? []), degrees('heading', 'Heading, °', ground.robot.heading)]
      )
    case 'target':
      return at(ground.target)
    case 'mover':
      return at(ground.movers[index])
    case 'circle':
      return circle ? [...(at(circle) ?? []), metres('radius', 'Radius, m', circle.radius, 0.05)] : null
    case 'box':
      return box
        ? [
            ...(at(box) ?? []),
            degrees('angle', 'Angle, °', box.angle ?? 0),
            metres('length', 'Length, m', box.length, 0.05),
            metres('width', 'Width, m', box.width, 0.05),
          ]
        : null
  }
}

/** The change that puts a thing where the numbers say. */
export function placing({ thing, index }: Chosen, numbers: { [name: string]: number }): PlaygroundChange {
  const { x = 0, y = 0, heading = 0, radius = 0.3, length = 1, width = 0.4, angle = 0 } = numbers
  switch (thing) {
    case 'robot':
      return { act: 'put robot', x, y, heading }
    case 'target':
      return { act: 'put target', x, y }
    case 'mover':
      return { act: 'put mover', index, x, y }
    case 'circle':
      return { act: 'put circle', index, x, y, radius }
    case 'box':
      return { act: 'put box', index, x, y, length, width, angle }
  }
}
