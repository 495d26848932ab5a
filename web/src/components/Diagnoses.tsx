/** Is it learning? What the curves say is wrong with a run, each with its evidence and what to try; nothing while it is well. */
import { Stack } from '@mantine/core'
import { $api } from '../api/client'
import type { Diagnosis, RunState } from '../api/types'
import { significant } from '../lib/format'
import classes from './Diagnoses.module.css'
import { Notice, Panel } from './ui'

/** Milliseconds between two questions while the run goes on: what is wrong does not change faster. */
const ASK_AGAIN = 10_000

export function Diagnoses({ runId, state }: { runId: string; state: RunState }) {
  const going = state === 'running' || state === 'stopping'
  const { data } = $api.useQuery(
    'get',
    '/api/runs/{run_id}/diagnoses',
    { params: { path: { run_id: runId } } },
    { refetchInterval: going ? ASK_AGAIN : false },
  )
  if (!data || data.diagnoses.length === 0) return null
  return (
    <Panel title="Is it learning?" data-testid="diagnoses">
      <Stack gap="sm">
        {data.diagnoses.map((diagnosis) => (
          <Finding key={diagnosis.id} diagnosis={diagnosis} />
        ))}
      </Stack>
    </Panel>
  )
}

function Finding({ diagnosis }: { diagnosis: Diagnosis }) {
  const { id, title, severity, explanation, evidence, advice } = diagnosis
  return (
    <Notice title={title} bad={severity === 'error'} data-testid={`diagnosis-${id}`}>
      <p className={classes.text}>{explanation}</p>
      <ul className={classes.evidence} aria-label="Evidence">
        {evidence.map(({ metric, value, expected }) => (
          <li key={metric}>
            <code>{metric}</code> {value === null ? 'not a number' : significant(value, 3)}{' '}
            <span className={classes.quiet}>healthy: {expected}</span>
          </li>
        ))}
      </ul>
      <details>
        <summary>What to try</summary>
        <ol className={classes.advice}>
          {advice.map((line) => (
            <li key={line}>{line}</li>
          ))}
        </ol>
      </details>
    </Notice>
  )
}
