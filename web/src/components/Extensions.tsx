/** What a training needs besides Mapless: which extensions, and how to get them. */
import { List } from '@mantine/core'
import type { UsedExtension } from '../api/types'
import { Notice } from './ui'

/** "my_lab 1.2, other 3.0". */
export const namesOf = (extensions: readonly UsedExtension[]): string =>
  extensions.map(({ name, version }) => `${name}\u00a0${version}`).join(', ')

/** Says what a queued run waits for; nothing where it waits for any worker. */
export function WaitsForExtensions({ extensions }: { extensions: readonly UsedExtension[] }) {
  if (extensions.length === 0) return null
  return (
    <Notice title={`Waits for a worker with ${namesOf(extensions)}`} data-testid="waits-for">
      No worker that is there has {extensions.length > 1 ? 'all of them' : 'it'}: install{' '}
      {extensions.length > 1 ? 'them' : 'it'} where one runs, and start that worker anew.
      <ExtensionSources extensions={extensions} />
    </Notice>
  )
}

/** How to get extensions, in the words of their authors. */
export function ExtensionSources({ extensions }: { extensions: readonly UsedExtension[] }) {
  const known = extensions.filter(({ source }) => source)
  if (known.length === 0) return null
  return (
    <List size="sm" mt={4}>
      {known.map(({ name, source }) => (
        <List.Item key={name}>
          <code>{source}</code>
        </List.Item>
      ))}
    </List>
  )
}
