/** What the pages make of a robot's recording: addresses, charts, what a number is written as. */
import type { components } from '../../api/schema'
import type { ChartData } from '../../charts/series'
import type { Json } from '../../form/schema'
import { withValue } from '../../form/values'
import { significant } from '../../lib/format'

type Schemas = components['schemas']
export type Reading = Schemas['BagReading']
export type Beside = Schemas['BagBeside']
export type Fitted = Schemas['Fitted']
export type Setting = Schemas['Setting']
export type Role = Schemas['Topic']['role']

export const ROLES: Record<Role, string> = {
  scan: 'Scans',
  odometry: 'Odometry',
  commands: 'Commands',
  goal: 'Goals',
}

/** The address of a launch form that begins with what was fitted. */
export function trainWith(settings: readonly Setting[]): string {
  const told = settings.map(({ path, value }) => [path.join('.'), value])
  return `/new?settings=${encodeURIComponent(JSON.stringify(told))}`
}

/** The defaults of the form with the settings of an address; what can't be read is left out. */
export function withSettings(values: Json, text: string | null): Json {
  if (text === null) return values
  try {
    const told = JSON.parse(text) as unknown
    if (!Array.isArray(told)) return values
    return told.reduce<Json>((into, each: unknown) => {
      if (!Array.isArray(each) || typeof each[0] !== 'string') return into
      return withValue(into, ['training', 'task', ...each[0].split('.')], each[1] as Json)
    }, values)
  } catch {
    return values
  }
}

/** "0.0101 m, 0.0099 to 0.0102". */
export function intervalOf({ low, high, unit }: Fitted): string {
  if (low === null && high === null) return ''
  if (high === null) return `at least ${significant(low ?? 0, 3)} ${unit}`
  return `${significant(low ?? 0, 3)} to ${significant(high, 3)}`
}

/** The place of the last time that is not after `time`; the first where all are. */
export function placeAt(times: readonly number[], time: number): number {
  let [low, high] = [0, times.length - 1]
  while (low < high) {
    const middle = Math.ceil((low + high) / 2)
    if ((times[middle] ?? 0) <= time) low = middle
    else high = middle - 1
  }
  return low
}

/** Speed or turning over time: the robot's, what it was asked for and, where one is chosen, the policy's. */
export function stripOf(
  reading: Reading,
  beside: Beside | undefined,
  axis: 'forwards' | 'turning',
): ChartData {
  const asked = axis === 'forwards' ? reading.asked_forwards : reading.asked_turning
  if (!beside) {
    return {
      x: reading.times,
      lines: [
        { key: 'robot', label: 'robot', color: 0, values: reading[axis] },
        { key: 'asked', label: 'asked for', color: 2, thin: true, values: asked },
      ],
    }
  }
  const did = axis === 'forwards' ? beside.did_forwards : beside.did_turning
  return {
    x: beside.times,
    lines: [
      { key: 'robot', label: 'robot', color: 0, values: did },
      { key: 'policy', label: 'policy', color: 1, values: beside[axis] },
      {
        key: 'asked',
        label: 'asked for',
        color: 2,
        thin: true,
        values: beside.times.map((time) => asked[placeAt(reading.times, time)] ?? null),
      },
    ],
  }
}

/** Where a robot comes to that keeps its speeds, from a pose: points of its arc, metres. */
export function arcOf(
  [x, y, heading]: readonly [number, number, number],
  forwards: number,
  turning: number,
  seconds = 2,
): [number, number][] {
  const steps = 16
  const points: [number, number][] = [[x, y]]
  let [px, py, angle] = [x, y, heading]
  for (let step = 0; step < steps; step++) {
    const time = seconds / steps
    px += forwards * time * Math.cos(angle + (turning * time) / 2)
    py += forwards * time * Math.sin(angle + (turning * time) / 2)
    angle += turning * time
    points.push([px, py])
  }
  return points
}
