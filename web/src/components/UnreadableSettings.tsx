/** Says which settings of a training this version can't read, where the defaults are shown instead; nothing where it can. */
import { List } from '@mantine/core'
import { Notice } from './ui'

export function UnreadableSettings({ names }: { names: readonly string[] }) {
  if (names.length === 0) return null
  return (
    <Notice title="Some settings are of another version" data-testid="unreadable">
      This version can't read these settings. It shows its defaults in their place, and trains none of the
      runs: launch the training anew.
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
