/** Arenas as scenarios of suites of one's own, by the suites' names. */
import { $api } from '../../api/client'
import type { components } from '../../api/schema'

type OwnSuite = components['schemas']['server__suites__schemas__OwnSuite']

interface OwnSuites {
  /** Of the suites that there are. */
  names: string[]
  /** Puts an arena of the gallery into the suite of that name, which is made where there is none. */
  add: (name: string, sha256: string) => Promise<OwnSuite>
}

export function useOwnSuite(): OwnSuites {
  const { data: suites = [] } = $api.useQuery('get', '/api/suites')
  const made = $api.useMutation('post', '/api/suites')
  const added = $api.useMutation('post', '/api/suites/{suite_id}/scenarios')
  return {
    names: suites.map((suite) => suite.name),
    add: async (name, sha256) => {
      const known = suites.find((suite) => suite.name === name)
      const { id } = known ?? (await made.mutateAsync({ body: { name } }))
      return added.mutateAsync({ params: { path: { suite_id: id } }, body: { sha256 } })
    },
  }
}
