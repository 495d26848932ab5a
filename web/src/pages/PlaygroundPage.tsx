/** A playground: a policy drives in 3D while whoever opened it moves things, pushes it, and dims what it sees. */
import { Button } from '@mantine/core'
import { Link, useParams } from 'react-router'
import { $api } from '../api/client'
import { Ground } from '../components/playground/Ground'
import { Page, Panel, QueryError } from '../components/ui'
import { useTitle } from '../lib/hooks'

/** Between two looks at where things are. */
const LOOK_MS = 400

export function PlaygroundPage() {
  const { playgroundId = '' } = useParams()
  useTitle('Playground')
  return <OpenGround key={playgroundId} id={playgroundId} />
}

function OpenGround({ id }: { id: string }) {
  const { data, error, refetch } = $api.useQuery(
    'get',
    '/api/playgrounds/{playground_id}',
    { params: { path: { playground_id: id } } },
    { refetchInterval: (query) => (query.state.error ? false : LOOK_MS) },
  )
  const gone = error !== null && !data
  return (
    <Page
      title={data ? `Playground: ${data.policy}` : 'Playground'}
      actions={
        <Button component={Link} to="/playground" variant="default">
          Another one
        </Button>
      }
    >
      {gone ? (
        <Panel>
          <QueryError error={error} what="playground" retry={refetch} />
        </Panel>
      ) : (
        data && <Ground ground={data} />
      )}
    </Page>
  )
}
