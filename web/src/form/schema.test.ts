import { describe, expect, test } from 'vitest'
import { form } from '../testing/examples'
import { labelsOf } from './labels'
import { fieldsOf, grouped } from './layout'
import { locToPath, problemOf, problemsByPath } from './problems'
import { branches, defaults, type Json, range, resolve, type Schema } from './schema'
import { sameValue, valueAt, withValue } from './values'

const root = form.schema as Schema
const initial = form.defaults as unknown as Json

describe('defaults', () => {
  test('a default beside a reference wins over what is referred to', () => {
    expect(defaults(root, root)).toEqual(initial)
  })

  test('each algorithm brings its own, also for what is nested in it', () => {
    const ddpg = branches(
      resolve({ $ref: '#/$defs/Training' }, root).properties?.algorithm as Schema,
      root,
    )[1]
    expect(ddpg?.tag).toBe('ddpg')
    expect(defaults(ddpg?.schema as Schema, root)).toEqual({
      name: 'ddpg',
      network: { name: 'mlp', hidden_sizes: [128, 128], activation: 'relu' },
      tau: 0.01,
    })
  })

  test('a reference to nothing is an error that names it', () => {
    expect(() => resolve({ $ref: '#/$defs/Nowhere' }, root)).toThrow('#/$defs/Nowhere')
  })
})

describe('layout', () => {
  const keys = (values: Json) => fieldsOf(root, root, values).map((field) => field.key)

  test('only the chosen branch of a union has fields, and the tag is none of them', () => {
    expect(keys(initial)).toEqual([
      'name',
      'seeds',
      'training.task.arena.name',
      'training.task.observation',
      'training.task.reward.name',
      'training.task.reward.arrival',
      'training.algorithm',
      'training.algorithm.network',
      'training.algorithm.network.hidden_sizes',
      'training.algorithm.network.activation',
      'training.algorithm.learning_rate',
      'training.algorithm.robots',
      'training.steps',
    ])
    const resblock = withValue(initial, ['training', 'algorithm', 'network'], { name: 'resblock' })
    expect(keys(resblock)).not.toContain('training.algorithm.network.hidden_sizes')
  })

  test('the options of a union stand in the order of the model', () => {
    const algorithm = fieldsOf(root, root, initial).find((field) => field.key === 'training.algorithm')
    expect(algorithm).toMatchObject({
      kind: 'union',
      options: [
        { value: 'ppo', label: 'PPO' },
        { value: 'ddpg', label: 'DDPG' },
      ],
    })
  })

  test('a kind that has no alternative is named by its heading', () => {
    const reward = fieldsOf(root, root, initial).find((field) => field.key === 'training.task.reward.name')
    expect(reward).toMatchObject({
      label: 'Reward',
      kind: 'choice',
      options: [{ value: 'basic', label: 'Basic' }],
    })
  })

  test('advanced fields are grouped under their innermost heading', () => {
    const advanced = fieldsOf(root, root, initial).filter((field) => field.advanced)
    expect(
      grouped(advanced).map(([heading, fields]) => [heading, fields.map((field) => field.label)]),
    ).toEqual([
      ['Reward', ['Arrival reward']],
      ['Network', ['Hidden layers', 'Activation']],
      ['Algorithm', ['Learning rate', 'Robots']],
    ])
  })

  test('a setting is called as its title, with its headings', () => {
    expect(labelsOf(root, ['training', 'algorithm', 'network', 'hidden_sizes']).slice(1)).toEqual([
      'Algorithm',
      'Network',
      'Hidden layers',
    ])
    expect(labelsOf(root, ['training', 'algorithm', 'network', 'name']).at(-1)).toBe('Network')
    expect(labelsOf(root, ['training', 'something_new']).at(-1)).toBe('Something new')
  })
})

test('ranges in words', () => {
  expect(range({ minimum: 1, maximum: 4096 }, String)).toBe('1 to 4096')
  expect(range({ exclusiveMinimum: 0, maximum: 0.1 }, String)).toBe('above 0, at most 0.1')
  expect(range({}, String)).toBeUndefined()
})

describe('values', () => {
  test('writing shares what lies beside the path', () => {
    const after = withValue(initial, ['training', 'steps'], 5000)
    expect(valueAt(after, ['training', 'steps'])).toBe(5000)
    expect(valueAt(initial, ['training', 'steps'])).toBe(300_000)
    expect(valueAt(after, ['training', 'task'])).toBe(valueAt(initial, ['training', 'task']))
  })

  test('the order of keys makes no difference, the order of a list does', () => {
    expect(sameValue({ a: 1, b: [1, 2] }, { b: [1, 2], a: 1 })).toBe(true)
    expect(sameValue([1, 2], [2, 1])).toBe(false)
    expect(sameValue({ a: 1 }, { a: 1, b: 2 })).toBe(false)
  })
})

describe('refusals of the server', () => {
  test.each([
    [['body', 'training', 'algorithm', 'ppo', 'learning_rate'], 'training.algorithm.learning_rate'],
    [
      ['body', 'training', 'algorithm', 'ppo', 'network', 'mlp', 'hidden_sizes', 1],
      'training.algorithm.network.hidden_sizes.1',
    ],
    [['body', 'training', 'algorithm', 'ppo'], 'training.algorithm'],
    [['body', 'name'], 'name'],
  ])('%j is about %s', (loc, path) => {
    expect(locToPath(loc, initial).join('.')).toBe(path)
  })

  test('an item of a list is a problem of the list; two of one field are joined', () => {
    const problems = problemsByPath(
      [
        { loc: ['body', 'seeds', 1], msg: 'Input should be a valid integer', type: 'int_parsing' },
        {
          loc: ['body', 'seeds'],
          msg: 'Value error, every seed may be there only once',
          type: 'value_error',
        },
      ],
      initial,
    )
    expect(problemOf(problems, 'seeds')).toBe(
      'Every seed may be there only once; Input should be a valid integer',
    )
    expect(problemOf(problems, 'name')).toBeUndefined()
  })
})
