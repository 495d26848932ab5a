/** Home: all trainings, to find, to order, and to act upon. */
import { Button, Group } from '@mantine/core'
import { useState } from 'react'
import { Link } from 'react-router'
import { IconPlus, IconRobot } from '../components/icons'
import { Message, Page } from '../components/ui'
import { HEADS } from '../heads'
import { useTitle } from '../lib/hooks'
import { ChosenBar, useAct } from '../workbench/ChosenBar'
import { Trainings } from '../workbench/Trainings'
import { ViewsMenu } from '../workbench/ViewsMenu'
import { useView } from '../workbench/view'

export function TrainingsPage() {
  useTitle(HEADS.TrainingsPage.title)
  const [view, setView] = useView()
  const [ticked, setTicked] = useState<readonly string[]>([])
  const { act } = useAct()
  return (
    <Page
      {...HEADS.TrainingsPage}
      actions={
        <Button component={Link} to="/new" leftSection={<IconPlus size={16} />}>
          New training
        </Button>
      }
    >
      <Trainings
        view={view}
        onView={(change) => {
          if (change.place) setTicked([])
          setView(change)
        }}
        ticked={ticked}
        onTick={setTicked}
        empty={<Invitation />}
        tools={<ViewsMenu view={view} />}
        above={<ChosenBar ticked={ticked} onTick={setTicked} view={view} />}
        onStar={({ id, starred }) => void act(starred ? 'unstar' : 'star', [id])}
      />
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
