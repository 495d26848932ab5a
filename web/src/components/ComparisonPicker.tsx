/** Trainings are ticked to be laid side by side. */
import { Button, Text } from '@mantine/core'
import { Link } from 'react-router'
import { MAX_COMPARED } from '../lib/comparison'
import { Trainings, usePickerView } from '../workbench/Trainings'
import { Message, Page } from './ui'

interface ComparisonPickerProps {
  chosen: readonly string[]
  onChoose: (ids: readonly string[]) => void
  onStart: () => void
  onDone: () => void
}

export function ComparisonPicker({ chosen, onChoose, onStart, onDone }: ComparisonPickerProps) {
  const tooMany = chosen.length > MAX_COMPARED
  const [view, setView] = usePickerView()
  return (
    <Page
      title="Compare"
      below={
        <Text size="sm" c="dimmed" mt={4}>
          Tick the trainings to lay side by side.
        </Text>
      }
      actions={
        <Button
          disabled={chosen.length === 0 || tooMany}
          title={tooMany ? `At most ${MAX_COMPARED} can be laid side by side` : undefined}
          onClick={onDone}
        >
          {chosen.length === 0 ? 'Compare' : `Compare ${chosen.length}`}
        </Button>
      }
    >
      <Trainings
        view={view}
        onView={setView}
        ticked={chosen}
        onTick={(ids) => {
          onStart()
          onChoose(ids)
        }}
        empty={
          <Message
            title="Nothing to compare yet"
            actions={
              <Button component={Link} to="/new">
                New training
              </Button>
            }
          >
            Launch two trainings that differ in one setting, each with five seeds.
          </Message>
        }
      />
    </Page>
  )
}
