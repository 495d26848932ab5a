import { screen, within } from '@testing-library/react'
import { expect, test, vi } from 'vitest'
import { open } from '../testing/render'
import { FakeEventSource, refusal, startServer } from '../testing/server'

vi.stubGlobal('EventSource', FakeEventSource)

const locked = refusal(401, 'Log in first.')
const account = {
  kind: 'person',
  name: 'ada',
  email: null,
  administrates: false,
  people: true,
  has_password: true,
  connected: false,
  may_launch: true,
}
const project = { id: 'p1', name: 'Halls', created_at: 1, experiments: 3, role: 'admin' }
const done = new Response(null, { status: 204 })

test('where there are accounts, name and password are asked for, and the server is quoted', async () => {
  const server = startServer({
    'GET /api/status': locked,
    'GET /api/sign-in': { people: true },
    'POST /api/sign-in': refusal(401, 'There is no such name with this password.'),
  })
  const { user } = open('/')
  await user.type(await screen.findByLabelText('Name'), ' ada')
  await user.type(screen.getByLabelText('Password'), 'wrong{Enter}')
  expect(await screen.findByText('There is no such name with this password.')).toBeInTheDocument()
  expect(server.changes.at(-1)).toEqual({
    route: 'POST /api/sign-in',
    body: { name: 'ada', password: 'wrong' },
  })
  await user.click(screen.getByRole('button', { name: 'use its token' }))
  expect(await screen.findByLabelText('Token')).toBeInTheDocument()
})

test('a provider of identities is led to, and quoted where it did not work out', async () => {
  const server = startServer({
    'GET /api/status': locked,
    'GET /api/sign-in': { people: false, provider: 'the university', refused: 'Who are you?' },
    'POST /api/sign-in/provider': refusal(503, 'the university does not answer.'),
  })
  const { user } = open('/queue?refused=stranger&tab=2')
  expect(await screen.findByText('Who are you?')).toBeInTheDocument()
  expect(screen.queryByLabelText('Password')).toBeNull()
  await user.click(screen.getByRole('button', { name: 'Sign in with the university' }))
  expect(await screen.findByText('the university does not answer.')).toBeInTheDocument()
  expect(server.changes.at(-1)).toEqual({
    route: 'POST /api/sign-in/provider',
    body: { back: '/queue?tab=2', invitation: null, connect: false },
  })
  expect(server.asked).toContain('/api/sign-in?refused=stranger')
})

test('without accounts nothing of people is shown', async () => {
  startServer({ 'GET /api/account': { ...account, kind: 'owner', people: false, administrates: true } })
  open('/nowhere')
  expect(await screen.findByText('There is no page here')).toBeInTheDocument()
  expect(screen.queryByRole('button', { name: /Account of/ })).toBeNull()
})

test('the menu shows administrators more than others', async () => {
  const server = startServer({ 'GET /api/account': account })
  const { user } = open('/nowhere')
  await user.click(await screen.findByRole('button', { name: 'Account of ada' }))
  expect(await screen.findByRole('menuitem', { name: 'My account' })).toBeInTheDocument()
  expect(screen.queryByRole('menuitem', { name: 'What was done' })).toBeNull()
  server.routes['POST /api/sign-out'] = done
  await user.click(screen.getByRole('menuitem', { name: 'Sign out' }))
  expect(server.changes).toEqual([{ route: 'POST /api/sign-out', body: null }])
})

test('an invitation is shown and accepted without a login', async () => {
  const server = startServer({
    'GET /api/status': locked,
    'GET /api/account': locked,
    'POST /api/invitations/look': {
      purpose: 'join',
      name: null,
      project: 'Halls',
      role: 'editor',
      admin: false,
      invited_by: 'root',
      expires_at: 2_000_000_000,
    },
    'POST /api/invitations/accept': done,
  })
  const { user } = open('/join#secret')
  expect(await screen.findByText(/root invited you as editor in Halls/)).toBeInTheDocument()
  await user.type(screen.getByLabelText(/Name/), 'ada')
  await user.type(screen.getByLabelText(/Password/), 'too short')
  expect(screen.getByRole('button', { name: 'Join' })).toBeDisabled()
  await user.type(screen.getByLabelText(/Password/), ' no more')
  await user.click(screen.getByRole('button', { name: 'Join' }))
  expect(server.changes.find(({ route }) => route.endsWith('accept'))?.body).toEqual({
    code: 'secret',
    name: 'ada',
    password: 'too short no more',
  })
})

test('a link that opens nothing says so', async () => {
  startServer({
    'GET /api/status': locked,
    'POST /api/invitations/look': refusal(404, 'This link has been used already.'),
  })
  open('/join#old')
  expect(await screen.findByRole('alert')).toHaveTextContent('This link has been used already.')
})

test('a token is shown once, listed and revoked', async () => {
  const token = {
    id: 't1',
    name: 'notebook',
    scope: 'read',
    projects: null,
    created_at: 1,
    expires_at: null,
    seen_at: null,
  }
  const server = startServer({
    'GET /api/account': account,
    'GET /api/account/sessions': [],
    'GET /api/account/tokens': [token],
    'POST /api/account/tokens': { ...token, token: 'mpl_secret' },
    'DELETE /api/account/tokens/t1': done,
  })
  const { user } = open('/account')
  await user.type(await screen.findByLabelText('For'), 'notebook')
  await user.click(screen.getByRole('button', { name: 'Make a token' }))
  expect(await screen.findByTestId('secret')).toHaveTextContent('mpl_secret')
  await user.click(within(await screen.findByTestId('token')).getByRole('button', { name: 'Revoke' }))
  expect(server.changes.map(({ route }) => route)).toEqual([
    'POST /api/account/tokens',
    'DELETE /api/account/tokens/t1',
  ])
})

test('a project leads to its trainings, to its members for who administrates it, out and in', async () => {
  const run = { id: 'r', experiment_id: 'e', outcome: 'imported', why: null }
  const server = startServer({
    'GET /api/account': account,
    'GET /api/projects': {
      items: [project, { ...project, id: 'p2', name: 'Streets', role: 'viewer' }],
      total: 2,
    },
    'POST /api/projects/p1/import': {
      project_id: 'p1',
      runs: [run, { ...run, outcome: 'refused', why: 'This server has another run of that id.' }],
      checkpoints: 1,
      others: [
        { kind: 'policy', id: 'u1', outcome: 'imported', why: null },
        { kind: 'evaluation', id: 'v1', outcome: 'imported', why: null },
        { kind: 'evaluation', id: 'v2', outcome: 'imported', why: null },
      ],
    },
  })
  const { user } = open('/projects')
  const [halls, streets] = (await screen.findAllByTestId('project')).map((row) => within(row))
  const leads = (row: typeof halls, name: string, to: string) =>
    expect(row?.getByRole('link', { name })).toHaveAttribute('href', to)
  leads(halls, 'Halls', '/?project=p1')
  leads(halls, 'Members', '/projects/p1')
  leads(halls, 'Export Halls', '/api/projects/p1/export')
  leads(streets, 'Export Streets', '/api/projects/p2/export')
  expect(streets?.queryByRole('link', { name: 'Members' })).toBeNull()
  expect(streets?.queryByRole('button', { name: 'Import into Streets' })).toBeNull()

  await user.upload(
    document.querySelector('input[type=file]') as HTMLInputElement,
    new File(['{"a": "tar"}'], 'mapless-halls.tar', { type: 'application/x-tar' }),
  )
  expect(
    await screen.findByText(
      '1 run imported, 1 upload imported, 2 evaluations imported, 1 run refused. This server has another run of that id.',
    ),
  ).toBeVisible()
  expect(server.changes).toEqual([{ route: 'POST /api/projects/p1/import', body: { a: 'tar' } }])
})

test('the log is filtered, and goes into a table', async () => {
  const entry = {
    id: 1,
    at: 1_700_000_000,
    actor: 'ada',
    address: '10.0.0.7',
    action: 'experiment.deleted',
    target: 'e1',
    name: 'Corridor',
    project_id: 'p1',
    details: null,
  }
  const server = startServer({
    'GET /api/account': { ...account, administrates: true },
    'GET /api/audit': { items: [entry], total: 1 },
  })
  const { user } = open('/audit')
  expect(await screen.findByTestId('entry')).toHaveTextContent('adaexperiment deletedCorridor10.0.0.7')
  await user.type(screen.getByLabelText('By whom'), 'ada')
  await vi.waitFor(() => expect(server.asked.at(-1)).toBe('/api/audit?actor=ada&limit=50&offset=0'))
  expect(screen.getByRole('link', { name: 'CSV' })).toHaveAttribute('href', '/api/audit/csv?actor=ada')
})

test('who came by a provider may sign out there, too; a provider without such a page is quoted', async () => {
  const server = startServer({
    'GET /api/account': { ...account, connected: true },
    'GET /api/sign-in': { people: true, provider: 'the university' },
    'GET /api/sign-in/provider/end': refusal(404, 'The university has no page that ends a session.'),
  })
  const { user } = open('/nowhere')
  await user.click(await screen.findByRole('button', { name: 'Account of ada' }))
  await user.click(await screen.findByRole('menuitem', { name: 'Sign out of the university, too' }))
  expect(await screen.findByText('The university has no page that ends a session.')).toBeInTheDocument()
  expect(server.changes).toEqual([])
})
