/** What can be done with a shipped policy: take it away, measure it elsewhere, train one like it, or train it further. */
import { Button, Menu } from '@mantine/core'
import { Link } from 'react-router'
import type { ShippedPolicy } from '../api/types'
import { at } from '../lib/base'
import { fileSize } from '../lib/format'
import { evaluate, play, policyKey } from './evaluations/choices'
import { IconCopy, IconDownload, IconPencil } from './icons'

interface PolicyActionsProps {
  policy: ShippedPolicy
  size?: 'xs' | 'sm'
}

export function PolicyActions({ policy, size = 'sm' }: PolicyActionsProps) {
  const path = at(`/api/policies/${policy.name}`)
  return (
    <>
      <Menu width={250}>
        <Menu.Target>
          <Button
            variant="default"
            size={size}
            leftSection={<IconDownload size={15} />}
            aria-label={`Download ${policy.title}`}
          >
            Download
          </Button>
        </Menu.Target>
        <Menu.Dropdown>
          <Menu.Item component="a" href={`${path}/download`} download>
            Checkpoint, {fileSize(policy.size)}
          </Menu.Item>
          <Menu.Item component="a" href={`${path}/bundle`} download>
            Robot bundle: ONNX and ROS 2
          </Menu.Item>
        </Menu.Dropdown>
      </Menu>
      <Button
        component={Link}
        to={play(policyKey('shipped', policy.name))}
        variant="default"
        size={size}
        aria-label={`Play with ${policy.title}`}
      >
        Play
      </Button>
      <Button
        component={Link}
        to={evaluate([policyKey('shipped', policy.name)])}
        variant="default"
        size={size}
        aria-label={`Evaluate ${policy.title}`}
      >
        Evaluate
      </Button>
      <Button
        component={Link}
        to={`/new?policy=${policy.name}`}
        variant="default"
        size={size}
        leftSection={<IconCopy size={15} />}
        aria-label={`Train one like it: ${policy.title}`}
      >
        Train one like it
      </Button>
      <Button
        component={Link}
        to={`/new?shipped=${policy.name}`}
        variant="default"
        size={size}
        leftSection={<IconPencil size={15} />}
        aria-label={`Fine-tune ${policy.title}`}
      >
        Fine-tune
      </Button>
    </>
  )
}
