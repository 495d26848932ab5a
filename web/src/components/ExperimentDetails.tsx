/** What stands below a training's runs: where it comes from, its curves, its settings, its notes. Its code comes when it is near. */
import { Stack } from '@mantine/core'
import type { Experiment } from '../api/types'
import { NotesPanel } from '../workbench/NotesPanel'
import { Configuration } from './Configuration'
import { CurvePanels } from './CurvePanels'
import { ExperimentLineage } from './Lineage'
import { Panel } from './ui'

export function ExperimentDetails({ experiment }: { experiment: Experiment }) {
  return (
    <Stack gap="md">
      <ExperimentLineage experimentId={experiment.id} />
      <CurvePanels experiments={[experiment.id]} />
      <Panel title="Configuration">
        <Configuration training={experiment.training} />
      </Panel>
      <NotesPanel experimentId={experiment.id} />
    </Stack>
  )
}
