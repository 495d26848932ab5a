/** Where a training is launched into: of the projects that one may launch into the chosen one, that one looks at, or the first. */
import { useState } from 'react'
import { $api } from '../../api/client'
import { chosenProject } from '../../workbench/view'

export function useLaunchProject() {
  const [chosen, choose] = useState<string>()
  const { data } = $api.useQuery('get', '/api/projects', { params: { query: { limit: 200 } } })
  const projects = data?.items.filter(({ role }) => role !== 'viewer') ?? []
  // What stands in the first project of the database stays there where nobody made others.
  const named = (wanted: string) => projects.find(({ id }) => id === wanted)
  const first = named(chosenProject()) ?? named('default') ?? projects[0]
  return { projects, project: chosen ?? first?.id, choose }
}
