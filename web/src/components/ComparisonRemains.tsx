/** What is left of a comparison of which some trainings were deleted, and where those are. */
import { Anchor, Button, Group, Skeleton } from '@mantine/core'
import { useQueries } from '@tanstack/react-query'
import type { ReactNode } from 'react'
import { Link } from 'react-router'
import { $api } from '../api/client'
import { isNotFound } from '../api/errors'
import { HEADS } from '../heads'
import { plural } from '../lib/format'
import { Message, Notice, Page, Panel } from './ui'

const TRASH = '/?place=trash'
/** Of the trash, to tell those that lie there by name. */
const IN_TRASH = 100

interface ComparisonRemainsProps {
  chosen: readonly string[]
  onChange: () => void
  /** The comparison of those that are there, two at least, with what has to be said of the others. */
  children: (there: readonly string[], notice: ReactNode) => ReactNode
}

export function ComparisonRemains({ chosen, onChange, children }: ComparisonRemainsProps) {
  const asked = useQueries({
    queries: chosen.map((experiment_id) =>
      $api.queryOptions(
        'get',
        '/api/experiments/{experiment_id}',
        { params: { path: { experiment_id } } },
        { retry: false },
      ),
    ),
  })
  const trash = $api.useQuery('get', '/api/experiments', {
    params: { query: { place: 'trash', limit: IN_TRASH } },
  })
  if (trash.isPending || asked.some(({ isPending }) => isPending))
    return (
      <Page {...HEADS.ComparePage}>
        <Skeleton height={240} />
      </Page>
    )
  const gone = chosen.filter((_, index) => isNotFound(asked[index]?.error))
  const there = chosen.filter((id) => !gone.includes(id))
  const thrown = (trash.data?.items ?? []).filter(({ id }) => gone.includes(id))
  const lost = gone.length - thrown.length
  const where = (
    <>
      {thrown.length > 0 && (
        <>
          {thrown.map(({ name }) => name).join(', ')} {thrown.length === 1 ? 'lies' : 'lie'} in{' '}
          <Anchor component={Link} to={TRASH} inherit>
            the trash
          </Anchor>
          , from where {thrown.length === 1 ? 'it' : 'they'} can be taken out again.{' '}
        </>
      )}
      {lost > 0 &&
        `${plural(lost, 'training')} ${lost === 1 ? 'is' : 'are'} gone, or the address is not complete.`}
    </>
  )
  if (there.length >= 2)
    return children(
      there,
      <Notice title={`${gone.length} of ${plural(chosen.length, 'training')} left out`} data-testid="gone">
        {where}
      </Notice>,
    )
  const [only] = there
  const name = asked[chosen.indexOf(only ?? '')]?.data?.name
  return (
    <Page {...HEADS.ComparePage}>
      <Panel>
        <Message
          title={
            only
              ? `Only ${name ?? 'one'} is left of ${plural(chosen.length, 'training')}`
              : chosen.length === 1
                ? 'This training is not there any more'
                : `None of these ${plural(chosen.length, 'training')} is there any more`
          }
          role="alert"
          actions={
            <Group gap="xs" justify="center">
              {only && (
                <Button component={Link} to={`/experiments/${only}`} variant="default">
                  Open {name ?? 'it'}
                </Button>
              )}
              <Button variant="default" onClick={onChange}>
                Choose others
              </Button>
            </Group>
          }
        >
          {where}
        </Message>
      </Panel>
    </Page>
  )
}
