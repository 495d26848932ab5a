/** Says which settings of a training this version can't read, where the defaults are shown instead; nothing where it can. */
import { List } from '@mantine/core'
import type { UsedExtension } from '../api/types'
import { ExtensionSources, namesOf } from './Extensions'
import { Notice } from './ui'

export function UnreadableSettings({
  names,
  lacking,
}: {
  names: readonly string[]
  lacking: readonly UsedExtension[]
}) {
  if (names.length === 0) return null
  const title =
    lacking.length > 0
      ? `Made with ${namesOf(lacking)}, which is not here`
      : 'Some settings are of another version'
  return (
    <Notice title={title} data-testid="unreadable">
      {lacking.length > 0
        ? "Without it the service can't read these settings. It shows its defaults in their place; runs wait until it is installed."
        : "This version can't read these settings. It shows its defaults in their place, and trains none of the runs: launch the training anew."}
      <ExtensionSources extensions={lacking} />
      <List size="sm" mt={4}>
        {names.map((name) => (
          <List.Item key={name}>
            <code>{name || 'all of them'}</code>
          </List.Item>
        ))}
      </List>
    </Notice>
  )
}
