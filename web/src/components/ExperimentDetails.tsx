/** What stands below a training's runs: where it comes from, its curves, its settings, its notes. Its code comes when it is near. */
import { Stack } from '@mantine/core'
import type { Experiment } from '../api/types'
import { NotesPanel } from '../workbench/NotesPanel'
import { Below } from './Below'
import { Configuration } from './Configuration'
import { CurvePanels } from './CurvePanels'
import { ExperimentLineage } from './Lineage'
import { Panel } from './ui'

/** About what it is high. */
const HEIGHT = 1_400

export function ExperimentDetails({ experiment }: { experiment: Experiment }) {
  return (
    <Stack gap="md">
      <Below height={HEIGHT}>
        <ExperimentLineage experimentId={experiment.id} />
        <CurvePanels experiments={[experiment.id]} />
        <Panel title="Configuration">
          <Configuration training={experiment.training} />
        </Panel>
        <NotesPanel experimentId={experiment.id} />
      </Below>
    </Stack>
  )
}
