/** Home: all experiments, to find, to tick for comparison, and to act upon. */
import { Button, Group } from '@mantine/core'
import { useState } from 'react'
import { Link, useNavigate } from 'react-router'
import { ExperimentList } from '../components/ExperimentList'
import { IconArrowsDiff, IconPlus, IconRobot } from '../components/icons'
import { Message, Page } from '../components/ui'
import { MAX_COMPARED } from '../lib/comparison'
import { useTitle } from '../lib/hooks'

export function TrainingsPage() {
  useTitle('Trainings')
  const navigate = useNavigate()
  const [ticked, setTicked] = useState<readonly string[]>([])
  const comparison = ticked.map((id) => `experiment=${id}`).join('&')
  const tooMany = ticked.length > MAX_COMPARED

  return (
    <Page
      title="Trainings"
      actions={
        <Group gap="xs">
          <Button
            variant="default"
            leftSection={<IconArrowsDiff size={16} />}
            disabled={ticked.length === 0 || tooMany}
            title={tooMany ? `At most ${MAX_COMPARED} can be laid side by side` : undefined}
            onClick={() => navigate(`/compare?${comparison}`)}
          >
            {ticked.length === 0 ? 'Compare' : `Compare ${ticked.length}`}
          </Button>
          <Button component={Link} to="/new" leftSection={<IconPlus size={16} />}>
            New training
          </Button>
        </Group>
      }
    >
      <ExperimentList ticked={ticked} onTick={setTicked} empty={<Invitation />} />
    </Page>
  )
}

function Invitation() {
  return (
    <Message
      icon={<IconRobot size={44} stroke={1.2} />}
      title="Nothing trained yet"
      actions={
        <Group gap="xs" justify="center">
          <Button component={Link} to="/new">
            Launch your first training
          </Button>
          <Button variant="default" component={Link} to="/reproduction">
            Reproduce the paper
          </Button>
        </Group>
      }
    >
      The defaults train a robot to find its way in a simple arena within half a minute, and you can watch it
      learn.
    </Message>
  )
}
