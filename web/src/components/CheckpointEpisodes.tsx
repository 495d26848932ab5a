/** The episodes of a checkpoint's evaluation; which of them is replayed stands in the address, to be passed on. */
import { $api } from '../api/client'
import type { Checkpoint } from '../api/types'
import { arranged } from '../lib/episodes'
import { useReplayInAddress } from '../lib/hooks'
import { useArrangement } from '../lib/useArrangement'
import { EpisodesQuery } from './Episodes'
import { Replay } from './replay/Replay'

/** Nothing of an evaluation ever changes. */
const FOR_GOOD = { staleTime: Number.POSITIVE_INFINITY }

export function CheckpointEpisodes({ checkpoint }: { checkpoint: Checkpoint }) {
  const [episode, setEpisode] = useReplayInAddress()
  const [{ order, reversed }] = useArrangement()
  const path = { checkpoint_id: checkpoint.id }
  const episodes = $api.useQuery(
    'get',
    '/api/checkpoints/{checkpoint_id}/episodes',
    { params: { path } },
    FOR_GOOD,
  )
  return (
    <>
      <EpisodesQuery query={episodes} onReplay={setEpisode} />
      {episode !== null && (
        <Replay
          of={`checkpoint:${checkpoint.id}`}
          episode={episode}
          order={arranged(episodes.data ?? { episodes: [] }, order, reversed).map(({ index }) => index)}
          onReplay={setEpisode}
          onClose={() => setEpisode(null)}
        />
      )}
    </>
  )
}
