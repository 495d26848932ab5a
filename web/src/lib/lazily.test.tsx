import { render, screen } from '@testing-library/react'
import { type ComponentType, StrictMode } from 'react'
import { expect, test, vi } from 'vitest'
import { Boundary } from '../components/Broken'
import { lazily } from './lazily'

const Greeting = ({ name }: { name: string }) => <p>Hello {name}</p>

test('what stands in its place gives way once the code has come, and the next time nothing is waited for', async () => {
  const load = vi.fn(async () => Greeting)
  const Later = lazily(load)

  const first = render(<Later name="Ada" meanwhile={<i>coming</i>} />)
  expect(screen.getByText('coming')).toBeInTheDocument()
  expect(await screen.findByText('Hello Ada')).toBeInTheDocument()
  expect(screen.queryByText('coming')).toBeNull()
  first.unmount()

  render(<Later name="Grace" meanwhile={<i>coming</i>} />)
  expect(screen.getByText('Hello Grace')).toBeInTheDocument()
  expect(load).toHaveBeenCalledTimes(1)
})

test('without anything in its place there is nothing, and it keeps its state as its properties change', async () => {
  const Later = lazily(async () => Greeting)
  const { container, rerender } = render(
    <StrictMode>
      <Later name="Ada" />
    </StrictMode>,
  )
  expect(container).toBeEmptyDOMElement()
  const there = await screen.findByText('Hello Ada')
  rerender(
    <StrictMode>
      <Later name="Grace" />
    </StrictMode>,
  )
  expect(there).toHaveTextContent('Hello Grace')
})

test('code that does not come is what broke, for the boundary around it', async () => {
  vi.spyOn(console, 'error').mockImplementation(() => {})
  const Later = lazily((): Promise<ComponentType> => Promise.reject(new Error('no network')))
  render(
    <Boundary at="/">
      <Later />
    </Boundary>,
  )
  expect(await screen.findByRole('alert')).toHaveTextContent('no network')
})
