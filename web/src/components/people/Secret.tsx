/** A link or a token that is shown this once. */
import { Alert, Button, Code, CopyButton, Group, Text } from '@mantine/core'

export function Secret({ title, text, onClose }: { title: string; text: string; onClose: () => void }) {
  return (
    <Alert
      title={title}
      variant="default"
      withCloseButton
      onClose={onClose}
      closeButtonLabel="Close"
      data-testid="secret"
    >
      <Text size="sm" mb="xs">
        Copy it now: it is not shown again.
      </Text>
      <Group gap="xs">
        <Code style={{ overflowWrap: 'anywhere' }}>{text}</Code>
        <CopyButton value={text}>
          {({ copied, copy }) => (
            <Button size="compact-xs" variant="default" onClick={copy}>
              {copied ? 'Copied' : 'Copy'}
            </Button>
          )}
        </CopyButton>
      </Group>
    </Alert>
  )
}
