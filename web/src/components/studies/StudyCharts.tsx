/** What a study's trials show: how the best grew, which settings mattered, which values did well, and at what cost. */
import { Box, Text } from '@mantine/core'
import { useNavigate } from 'react-router'
import { numbers } from '../../charts/axis'
import { ParallelCoordinates } from '../../charts/ParallelCoordinates'
import { Scatter } from '../../charts/Scatter'
import { percent, significant } from '../../lib/format'
import { Panel } from '../ui'
import { complete, front, history, merits, settingAxis, slice, successAxis, titleOf } from './charts'
import classes from './studies.module.css'
import type { Study } from './study'

export function StudyCharts({ study, titles }: { study: Study; titles: readonly string[] }) {
  const navigate = useNavigate()
  const named = { study, titles }
  const open = (number: string) => {
    const trial = study.results.find((one) => String(one.number) === number)
    if (trial?.experiment_id) void navigate(`/experiments/${trial.experiment_id}`)
  }
  const past = history(named)
  const unbeaten = front(named)
  const success = successAxis(study)
  if (past.points.length === 0) return null
  return (
    <>
      <div className={classes.charts}>
        <Panel title="History">
          <Scatter
            label="Success of each trial, and the best until then"
            x={numbers([1, Math.max(2, study.asked)], (value) => significant(value, 3))}
            y={success}
            xTitle="Trial"
            yTitle="Success"
            {...past}
            onOpen={open}
          />
          {study.results.some(({ state }) => state === 'pruned') && (
            <Text size="xs" c="dimmed" mt={4}>
              Grey, here and below: stopped early, at what was measured of them last.
            </Text>
          )}
        </Panel>
        <Panel title="Importance">
          <Importances study={study} titles={titles} />
        </Panel>
        <Panel title="Cost and success">
          <Scatter
            label="Success over training time; the line joins the trials that no other one beats in both"
            x={unbeaten.axis}
            y={success}
            xTitle="Training time of all its seeds"
            yTitle="Success"
            points={unbeaten.points}
            line={unbeaten.line}
            onOpen={open}
          />
        </Panel>
        {study.spec.settings.map((setting, index) => (
          <Panel key={setting.path} title={titles[index]}>
            <Scatter
              label={`Success by ${titles[index]}`}
              x={settingAxis(setting)}
              y={success}
              xTitle={
                setting.kind === 'range' && setting.log
                  ? `${titles[index]}, logarithmic`
                  : (titles[index] ?? '')
              }
              yTitle="Success"
              points={slice(named, setting.path)}
              onOpen={open}
            />
          </Panel>
        ))}
      </div>
      <Panel title="What went together">
        <Box className={classes.parallel} role="region" aria-label="What went together" tabIndex={0}>
          <Parallel study={study} titles={titles} onOpen={open} />
        </Box>
      </Panel>
    </>
  )
}

function Importances({ study, titles }: { study: Study; titles: readonly string[] }) {
  const { importances, importance_intervals: sure, spec } = study
  if (importances === null)
    return (
      <Text size="sm" c="dimmed">
        Said once eight trials are complete, and differ.
      </Text>
    )
  const shares = spec.settings
    .map(({ path }, index) => ({
      path,
      title: titles[index],
      share: importances[path] ?? 0,
      span: sure?.spans[path],
    }))
    .sort((a, b) => b.share - a.share)
  return (
    <>
      <table className={classes.importances} aria-label="Importance of each setting">
        <thead>
          <tr>
            <th scope="col">Setting</th>
            <th scope="col">Share</th>
            <th scope="col">95 % interval</th>
          </tr>
        </thead>
        <tbody>
          {shares.map(({ path, title, share, span }) => (
            <tr key={path}>
              <th scope="row">
                {title}
                <span className={classes.scale} aria-hidden>
                  <span className={classes.bar} style={{ width: `${share * 100}%` }} />
                  {span && (
                    <span
                      className={classes.span}
                      style={{ left: `${span.low * 100}%`, width: `${(span.high - span.low) * 100}%` }}
                    />
                  )}
                </span>
              </th>
              <td>{percent(share)}</td>
              <td>{span ? `${percent(span.low)} to ${percent(span.high)}` : '–'}</td>
            </tr>
          ))}
        </tbody>
      </table>
      <Text size="xs" c="dimmed" mt="sm">
        How much each had to do with being among the best tenth (PED-ANOVA). {sure?.told}
      </Text>
    </>
  )
}

function Parallel({
  study,
  titles,
  onOpen,
}: {
  study: Study
  titles: readonly string[]
  onOpen: (number: string) => void
}) {
  const { settings } = study.spec
  const merit = merits(study)
  return (
    <ParallelCoordinates
      label="Every complete trial's values, from axis to axis; the stronger the colour, the more success"
      axes={[
        ...settings.map((setting, index) => ({ title: titles[index] ?? '', axis: settingAxis(setting) })),
        { title: 'Success', axis: successAxis(study) },
      ]}
      lines={complete(study).map((trial) => ({
        key: String(trial.number),
        values: [...settings.map(({ path }) => trial.values[path]), trial.success],
        merit: merit.get(trial.number) ?? 0,
        best: trial.number === study.best,
        title: titleOf(trial, settings, titles),
      }))}
      onOpen={onOpen}
    />
  )
}
