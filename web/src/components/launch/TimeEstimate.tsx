/** How long a training will take, from how quick the runs like it were here. */
import { Text } from '@mantine/core'
import { $api } from '../../api/client'
import { useStatus } from '../../api/useStatus'
import type { Json } from '../../form/schema'
import { valueAt } from '../../form/values'
import { duration, plural } from '../../lib/format'

interface TimeEstimateProps {
  training: Json
  /** Runs of the training, or that a study launches at most. */
  runs: number
}

export function TimeEstimate({ training, runs }: TimeEstimateProps) {
  const name = (...path: string[]) => String(valueAt(training, path) ?? '')
  const { data: status } = useStatus()
  const { data: pace } = $api.useQuery(
    'get',
    '/api/training/pace',
    {
      params: {
        query: { algorithm: name('algorithm', 'name'), network: name('algorithm', 'network', 'name') },
      },
    },
    { staleTime: 60_000, retry: false },
  )
  const steps = valueAt(training, ['steps'])
  if (!pace || typeof steps !== 'number' || !(runs > 0)) return null
  if (pace.steps_per_second === null)
    return <Said>How long it takes is not known: none like it has run here yet.</Said>
  const workers = Math.max(1, status?.workers.length ?? 1)
  const seconds = (Math.ceil(runs / workers) * steps) / pace.steps_per_second
  return (
    <Said>
      About {duration(Math.max(1, roughly(seconds)))} once it begins, with {plural(workers, 'worker')} and as
      quick as {pace.runs === 1 ? 'one run' : `${pace.runs} runs`} like it here.
    </Said>
  )
}

const Said = ({ children }: { children: React.ReactNode }) => (
  <Text size="xs" c="dimmed" data-testid="time-estimate">
    {children}
  </Text>
)

/** Two digits: no forecast knows more. */
const roughly = (seconds: number): number => Number(seconds.toPrecision(2))
