/** A study's trials: what each tried, and what became of it. */
import { Anchor, Badge, Table, Text } from '@mantine/core'
import { Link } from 'react-router'
import { settingText } from '../../form/settingText'
import { duration, percent, significant } from '../../lib/format'
import table from '../ExperimentTable.module.css'
import { ProgressBar } from '../ui'
import ui from '../ui.module.css'
import { StudyStateLabel } from './StudyStateLabel'
import classes from './studies.module.css'
import { type Study, TRIAL_STATES, type Trial } from './study'

export function TrialTable({ study, titles }: { study: Study; titles: readonly string[] }) {
  return (
    <Table.ScrollContainer type="native" minWidth={560}>
      <Table className={table.table} highlightOnHover aria-label="Trials">
        <Table.Thead>
          <Table.Tr>
            <Table.Th>Trial</Table.Th>
            <Table.Th>State</Table.Th>
            {titles.map((title) => (
              <Table.Th key={title} ta="right">
                {title}
              </Table.Th>
            ))}
            <Table.Th ta="right">Success</Table.Th>
            <Table.Th ta="right">Time to target</Table.Th>
            <Table.Th ta="right">Trained for</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {[...study.results].reverse().map((trial) => (
            <Row key={trial.number} trial={trial} study={study} />
          ))}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  )
}

function Row({ trial, study }: { trial: Trial; study: Study }) {
  const { as, label } = TRIAL_STATES[trial.state]
  return (
    <Table.Tr data-testid="trial" data-state={trial.state}>
      <Table.Td className={classes.trial}>
        {trial.experiment_id ? (
          <Anchor component={Link} to={`/experiments/${trial.experiment_id}`} size="sm" fw={550}>
            Trial {trial.number}
          </Anchor>
        ) : (
          `Trial ${trial.number}`
        )}
        {trial.number === study.best && (
          <Badge ml={8} size="sm" variant="light">
            Best
          </Badge>
        )}
      </Table.Td>
      <Table.Td>
        <StudyStateLabel as={as} label={label} />
        {trial.state === 'running' && (
          <ProgressBar value={trial.progress} state={as} label={`Progress of trial ${trial.number}`} />
        )}
        {trial.reason && (
          <Text size="xs" c="dimmed" className={classes.reason}>
            {trial.reason}
          </Text>
        )}
      </Table.Td>
      {study.spec.settings.map(({ path }) => (
        <Table.Td key={path} ta="right" className={ui.number}>
          {settingText(trial.values[path])}
        </Table.Td>
      ))}
      <Table.Td ta="right" className={ui.number}>
        {trial.success === null ? '–' : percent(trial.success)}
      </Table.Td>
      <Table.Td ta="right" className={ui.number}>
        {trial.seconds_to_target === null ? '–' : `${significant(trial.seconds_to_target, 3)} s`}
      </Table.Td>
      <Table.Td ta="right" className={ui.number}>
        {trial.cost === null ? '–' : duration(trial.cost)}
      </Table.Td>
    </Table.Tr>
  )
}
