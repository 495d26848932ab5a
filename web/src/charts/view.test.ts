import { expect, test } from 'vitest'
import { logOf, readView, sharedX, writtenView } from './view'

test('a view is read from the address as it was written there, and leaves the rest of it alone', () => {
  const view = {
    across: 'wall',
    logX: true,
    logY: ['loss/value', 'Return, per episode'],
    panels: ['policy/kl', 'train/return'],
    smooth: { 'train/return': 0.8 },
    hidden: ['a'],
    zoom: [19_000, 36_000],
  } as const
  const written = writtenView(new URLSearchParams('experiment=a&experiment=b&x=cpu'), view)
  expect(written.toString()).toBe(
    'experiment=a&experiment=b&x=wall&xlog=1&ylog=loss%2Fvalue&ylog=Return%2C+per+episode&panel=policy%2Fkl&panel=train%2Freturn&smooth=0.8%7Etrain%2Freturn&hide=a&zoom=19000%7E36000',
  )
  expect(readView(written)).toEqual(view)
})

test('what is usual does not stand in the address, and what nobody could have chosen is not believed', () => {
  const usual = readView(new URLSearchParams('x=nonsense&xlog=maybe&zoom=9~3&smooth=2~train/return'))
  expect(usual).toEqual({
    across: 'steps',
    logX: false,
    logY: [],
    panels: null,
    smooth: {},
    hidden: [],
    zoom: null,
  })
  expect(writtenView(new URLSearchParams('x=nonsense&step=4'), usual).toString()).toBe('step=4')
  const many = new URLSearchParams(Array.from({ length: 500 }, (_, index) => ['ylog', `m/${index}`]))
  expect(readView(many).logY).toHaveLength(60)
})

test('one chart is switched to a logarithmic axis, and back', () => {
  let view = readView(new URLSearchParams('ylog=loss/value'))
  const change = (part: Partial<typeof view>) => {
    view = { ...view, ...part }
  }
  expect(logOf(view, change, 'policy/kl').on).toBe(false)
  logOf(view, change, 'policy/kl').set(true)
  expect(view.logY).toEqual(['loss/value', 'policy/kl'])
  logOf(view, change, 'loss/value').set(false)
  expect(view.logY).toEqual(['policy/kl'])
})

test('charts show all of x again where it becomes another one', () => {
  const view = readView(new URLSearchParams('x=wall'))
  expect(sharedX(view)).not.toBe(sharedX({ ...view, logX: true }))
  expect(sharedX(view)).not.toBe(sharedX({ ...view, across: 'cpu' }))
})
