/** Leads to the provider of identities, and back to the page that one comes from; says why it did not work out. */
import { Button, Text } from '@mantine/core'
import type { ReactNode } from 'react'
import { useLocation, useSearchParams } from 'react-router'
import { $api } from '../../api/client'
import { messageOf } from '../../api/errors'
import type { operations } from '../../api/schema'

type Refusal = NonNullable<
  NonNullable<operations['get_sign_in_options_api_sign_in_get']['parameters']['query']>['refused']
>

/** How one may sign in here; an address with a reason why it failed has it put into words. */
export function useSignInOptions() {
  const [search] = useSearchParams()
  const refused = search.get('refused') as Refusal | null
  return $api.useQuery(
    'get',
    '/api/sign-in',
    { params: { query: refused ? { refused } : {} } },
    { retry: false },
  )
}

export function ProviderButton({
  refused,
  invitation = null,
  connect = false,
  back,
  children,
}: {
  refused: string | null
  invitation?: string | null
  connect?: boolean
  /** Path of the page that it leads to; the one that is open if not given. */
  back?: string
  children: ReactNode
}) {
  const here = useLocation()
  const [search] = useSearchParams()
  const go = $api.useMutation('post', '/api/sign-in/provider', {
    onSuccess: ({ url }) => window.location.assign(url),
  })
  const start = () => {
    const left = new URLSearchParams(search)
    left.delete('refused')
    const path = here.pathname + (left.size > 0 ? `?${left}` : '')
    go.mutate({ body: { back: back ?? path, invitation, connect } })
  }
  const wrong = go.error ? messageOf(go.error) : refused
  return (
    <>
      {wrong && (
        <Text size="sm" c="red" role="alert">
          {wrong}
        </Text>
      )}
      {/* The browser is on its way until the page is left. */}
      <Button type="button" onClick={start} loading={go.isPending || go.isSuccess}>
        {children}
      </Button>
    </>
  )
}
