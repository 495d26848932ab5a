import { MantineProvider } from '@mantine/core'
import { fireEvent, render, screen, waitFor } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { expect, test } from 'vitest'
import { Hint } from './Hint'

function shown() {
  render(
    <MantineProvider env="test">
      <Hint label="Into the trash" delay={1}>
        <button type="button">Delete</button>
      </Hint>
    </MantineProvider>,
  )
  return screen.getByRole('button')
}

const words = () => screen.queryByText('Into the trash')

test('its words come when it is pointed at, and go when it is left', async () => {
  const button = shown()
  expect(words()).toBeNull()
  await userEvent.hover(button)
  await waitFor(() => expect(words()).toBeVisible())
  await userEvent.unhover(button)
  await waitFor(() => expect(words()).toBeNull())
})

test('Escape takes the words away without moving the mouse', async () => {
  await userEvent.hover(shown())
  await waitFor(() => expect(words()).toBeVisible())
  await userEvent.keyboard('{Escape}')
  await waitFor(() => expect(words()).toBeNull())
})

test('the keyboard gets them at once, and the focus stays where it was', async () => {
  const button = shown()
  await userEvent.tab()
  expect(words()).toBeVisible()
  expect(button).toHaveFocus()
  await userEvent.tab()
  await waitFor(() => expect(words()).toBeNull())
})

test('a finger gets none', async () => {
  const button = shown()
  fireEvent.pointerEnter(button, { pointerType: 'touch' })
  await new Promise((resolve) => setTimeout(resolve, 20))
  expect(words()).toBeNull()
})
