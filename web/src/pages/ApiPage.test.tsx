import { screen, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import { open } from '../testing/render'
import { FakeEventSource, refusal, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const description = {
  paths: {
    '/api/runs/{run_id}': { get: { tags: ['runs'], description: 'One `run`.' } },
    '/api/experiments': {
      post: {
        tags: ['experiments'],
        description: 'Launch into a project.',
        requestBody: {
          content: { 'application/json': { schema: { $ref: '#/components/schemas/ExperimentLaunch' } } },
        },
      },
    },
  },
}

test('the footer leads to a page of all operations, which can be searched', async () => {
  startServer({ 'GET /api/openapi.json': description })
  const { user } = open('/reference')

  expect(await screen.findAllByTestId('operation')).toHaveLength(2)
  expect(screen.getByRole('link', { name: 'API' })).toHaveAttribute('href', '/reference')
  await user.type(screen.getByRole('textbox', { name: 'Search the operations' }), 'launch')

  const launch = screen.getByTestId('operation')
  expect(within(launch).getByText(/POST/)).toBeVisible()
  expect(launch).toHaveTextContent('Sends ExperimentLaunch')
})

test('a server that does not describe itself is a message with another try', async () => {
  startServer({ 'GET /api/openapi.json': refusal(500, 'Out of words.') })
  open('/reference')

  expect(await screen.findByRole('button', { name: 'Try again' })).toBeVisible()
})
