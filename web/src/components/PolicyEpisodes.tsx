/** The episodes of a shipped policy on one of its suites; which, and which is replayed, stand in the address. */
import { useSearchParams } from 'react-router'
import { $api } from '../api/client'
import type { ShippedPolicy } from '../api/types'
import { arranged } from '../lib/episodes'
import { useReplayInAddress } from '../lib/hooks'
import { useArrangement } from '../lib/useArrangement'
import { EpisodesQuery } from './Episodes'
import { Replay } from './replay/Replay'
import { Segments } from './Segments'
import { Panel } from './ui'

const FOR_GOOD = { staleTime: Number.POSITIVE_INFINITY }

export function PolicyEpisodes({ policy }: { policy: ShippedPolicy }) {
  const suites = policy.results.map((result) => result.suite)
  const [search, setSearch] = useSearchParams()
  const named = search.get('suite')
  const suite = suites.find((each) => each === named) ?? suites[0] ?? ''
  const [episode, setEpisode] = useReplayInAddress()
  const [{ order, reversed }] = useArrangement()
  const path = { name: policy.name, suite }
  const episodes = $api.useQuery(
    'get',
    '/api/policies/{name}/suites/{suite}/episodes',
    { params: { path } },
    FOR_GOOD,
  )
  return (
    <Panel
      title={`Episodes on ${suite}`}
      flush
      actions={
        suites.length > 1 && (
          <Segments
            size="xs"
            aria-label="Suite"
            value={suite}
            onChange={(next) => setSearch({ suite: next }, { replace: true, preventScrollReset: true })}
            data={suites.map((name) => ({ value: name, label: name }))}
          />
        )
      }
    >
      <EpisodesQuery key={suite} query={episodes} onReplay={setEpisode} />
      {episode !== null && (
        <Replay
          of={`policy:${policy.name}:${suite}`}
          episode={episode}
          order={arranged(episodes.data ?? { episodes: [] }, order, reversed).map(({ index }) => index)}
          onReplay={setEpisode}
          onClose={() => setEpisode(null)}
        />
      )}
    </Panel>
  )
}
