import { screen } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import { listed, status } from '../testing/examples'
import { open } from '../testing/render'
import { FakeEventSource, refusal, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const locked = refusal(401, 'Log in first.')

test('without a login every page asks for the token, and goes on once it has it', async () => {
  const server = startServer({
    'GET /api/status': locked,
    'GET /api/experiments': locked,
    'POST /api/login': refusal(401, 'Wrong token.'),
  })
  const { user } = open('/')
  const token = await screen.findByLabelText('Token')
  expect(screen.getByText(/printed an address with a token/)).toBeInTheDocument()
  expect(FakeEventSource.open).toHaveLength(0)

  await user.type(token, 'wrong{Enter}')
  expect(await screen.findByText('That is not the token of this server.')).toBeInTheDocument()

  server.routes['POST /api/login'] = new Response(null, { status: 204 })
  server.routes['GET /api/status'] = status
  server.routes['GET /api/experiments'] = { items: [listed], total: 1 }
  await user.clear(token)
  await user.type(token, ' right {Enter}')
  expect(await screen.findByTestId('experiment')).toHaveTextContent('Corridor')
  expect(server.changes.at(-1)).toEqual({ route: 'POST /api/login', body: { token: 'right' } })
})

test('an address that leads nowhere', async () => {
  startServer({})
  open('/nowhere')
  expect(await screen.findByText('There is no page here')).toBeInTheDocument()
})
