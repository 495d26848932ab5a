/** The paper reproduced: one button, its tables beside ours, its figures, and a sentence for each of its claims. */
import { ActionIcon, Button, Group, Select, Skeleton, Stack, Tooltip } from '@mantine/core'
import { useDisclosure } from '@mantine/hooks'
import { keepPreviousData } from '@tanstack/react-query'
import { useSearchParams } from 'react-router'
import { useActions } from '../api/actions'
import { $api } from '../api/client'
import { isRefusal } from '../api/errors'
import type { Reproduction } from '../api/types'
import { Below } from '../components/Below'
import { DeleteDialog } from '../components/DeleteDialog'
import { IconPlayerPlay, IconPlayerStop, IconPlus, IconRocket, IconTrash } from '../components/icons'
import { useLaunchProject } from '../components/people/useLaunchProject'
import { CampaignState } from '../components/reproduction/CampaignState'
import { Claims } from '../components/reproduction/Claims'
import { PaperFigures } from '../components/reproduction/PaperFigures'
import { PaperTables } from '../components/reproduction/PaperTables'
import { canResume, isActive } from '../components/states'
import { Message, Page, Panel, QueryError } from '../components/ui'
import { HEADS } from '../heads'
import { age, dateTime, duration, plural } from '../lib/format'
import { useNow, useTitle } from '../lib/hooks'

const SEEDS = 5
/** Between two looks at a campaign that goes on. */
const EVERY_MS = 5_000
/** A trial shows within a minute or two that everything works; its figures mean nothing. */
const TRIAL = { seeds: 1, effort: 0.01 }

export function ReproductionPage() {
  useTitle(HEADS.ReproductionPage.title)
  const [search, setSearch] = useSearchParams()
  const campaign = search.get('campaign')
  const { data, error, refetch } = $api.useQuery(
    'get',
    '/api/reproduction',
    { params: { query: campaign ? { campaign } : {} } },
    {
      placeholderData: keepPreviousData,
      refetchInterval: ({ state }) =>
        state.data?.campaign && isActive(state.data.campaign.state) ? EVERY_MS : false,
    },
  )
  const showNewest = () => setSearch({}, { replace: true })
  return (
    <Page
      {...HEADS.ReproductionPage}
      actions={
        data?.campaign && (
          <Group gap="xs">
            <CampaignChoice
              reproduction={data}
              onChoose={(id) => setSearch({ campaign: id }, { replace: true })}
            />
            <CampaignActions reproduction={data} onLaunched={showNewest} />
            <DeleteCampaign campaign={data.campaign} rows={data.rows} onDeleted={showNewest} />
          </Group>
        )
      }
    >
      {error && (!data || isRefusal(error)) ? (
        <Panel>
          <QueryError error={error} what="reproduction" retry={refetch} />
        </Panel>
      ) : data ? (
        <Stack gap="md">
          {data.campaign ? (
            <CampaignState campaign={data.campaign} rows={data.rows} />
          ) : (
            <Invitation reproduction={data} />
          )}
          <Below height={1_200}>
            <PaperTables reproduction={data} />
          </Below>
          {data.campaign && (
            <Below height={700}>
              <PaperFigures reproduction={data} />
            </Below>
          )}
          <Below height={1_200}>
            <Claims claims={data.claims} />
          </Below>
        </Stack>
      ) : (
        <Stack key="loading" gap="md" aria-busy="true" aria-label="Loading the reproduction">
          {[110, 260, 260].map((height, index) => (
            // biome-ignore lint/suspicious/noArrayIndexKey: placeholders have no other identity.
            <Skeleton key={index} height={height} radius={8} />
          ))}
        </Stack>
      )}
    </Page>
  )
}

/** The project that a campaign is launched into. */
function useInto() {
  const { project } = useLaunchProject()
  return project === undefined ? {} : { params: { query: { project } } }
}

function Invitation({ reproduction: { seconds, workers, rows } }: { reproduction: Reproduction }) {
  const { launchReproduction } = useActions()
  const into = useInto()
  return (
    <Panel data-testid="invitation">
      <Message
        icon={<IconRocket size={44} stroke={1.2} />}
        title="Not reproduced here yet"
        actions={
          <Group gap="xs" justify="center">
            <Button
              loading={launchReproduction.isPending}
              onClick={() => launchReproduction.mutate({ ...into, body: { seeds: SEEDS, effort: 1 } })}
            >
              Reproduce the paper
            </Button>
            <Button
              variant="default"
              disabled={launchReproduction.isPending}
              onClick={() => launchReproduction.mutate({ ...into, body: TRIAL })}
            >
              Try it out first
            </Button>
          </Group>
        }
      >
        Trains every row of the paper's three tables with {plural(SEEDS, 'seed')}: {rows.length * SEEDS}{' '}
        trainings, about {duration(Math.round(seconds / 60) * 60)} with{' '}
        {plural(Math.max(1, workers), 'worker')}. It goes on after a restart, and you can watch every robot
        meanwhile. Trying it out takes one seed and 1 % of the steps.
      </Message>
    </Panel>
  )
}

function CampaignActions({
  reproduction: { campaign, rows, wanted },
  onLaunched,
}: {
  reproduction: Reproduction
  onLaunched: () => void
}) {
  const actions = useActions()
  const into = useInto()
  if (!campaign) return null
  const states = rows.flatMap((row) => row.runs.map((run) => run.state))
  const of = { params: { path: { campaign_id: campaign.id } } }
  const more = rows.reduce((sum, row) => sum + Math.max(0, (wanted[row.id] ?? 0) - row.runs.length), 0)
  if (isActive(campaign.state)) {
    return (
      <Button
        variant="default"
        leftSection={<IconPlayerStop size={16} />}
        disabled={campaign.state === 'stopping'}
        loading={actions.stopReproduction.isPending}
        onClick={() => actions.stopReproduction.mutate(of)}
      >
        Cancel all
      </Button>
    )
  }
  return (
    <>
      {canResume(states) && (
        <Button
          variant="default"
          leftSection={<IconPlayerPlay size={16} />}
          loading={actions.resumeReproduction.isPending}
          onClick={() => actions.resumeReproduction.mutate(of)}
        >
          Go on
        </Button>
      )}
      {more > 0 && (
        <Tooltip
          multiline
          w={300}
          label={`${plural(more, 'more training')} of ${plural(Object.keys(wanted).length, 'row')}: those whose intervals are wider than their margins, whichever way they point`}
        >
          <Button
            variant="default"
            leftSection={<IconPlus size={16} />}
            loading={actions.addSeedsToReproduction.isPending}
            onClick={() => actions.addSeedsToReproduction.mutate(of)}
          >
            More seeds
          </Button>
        </Tooltip>
      )}
      <Button
        leftSection={<IconRocket size={16} />}
        loading={actions.launchReproduction.isPending}
        onClick={() =>
          actions.launchReproduction.mutate(
            { ...into, body: { seeds: SEEDS, effort: 1 } },
            { onSuccess: onLaunched },
          )
        }
      >
        {campaign.effort < 1 ? 'Reproduce the paper' : 'Reproduce again'}
      </Button>
    </>
  )
}

function DeleteCampaign({
  campaign,
  rows,
  onDeleted,
}: {
  campaign: NonNullable<Reproduction['campaign']>
  rows: Reproduction['rows']
  onDeleted: () => void
}) {
  const { deleteReproduction } = useActions()
  const [asking, ask] = useDisclosure()
  const trainings = rows.reduce((sum, row) => sum + row.runs.length, 0)
  return (
    <>
      <Tooltip label="Delete this campaign">
        <ActionIcon variant="default" size={36} aria-label="Delete this campaign" onClick={ask.open}>
          <IconTrash size={16} />
        </ActionIcon>
      </Tooltip>
      <DeleteDialog
        opened={asking}
        what="this campaign"
        busy={deleteReproduction.isPending}
        onClose={ask.close}
        onDelete={() =>
          deleteReproduction.mutate(
            { params: { path: { campaign_id: campaign.id } } },
            {
              onSuccess: () => {
                ask.close()
                onDeleted()
              },
            },
          )
        }
      >
        Its {plural(trainings, 'training')}, their curves and checkpoints are removed for good. Runs that are
        going on are ended.
      </DeleteDialog>
    </>
  )
}

function CampaignChoice({
  reproduction: { campaign, campaigns },
  onChoose,
}: {
  reproduction: Reproduction
  onChoose: (id: string) => void
}) {
  const now = useNow()
  if (!campaign || campaigns.length < 2) return null
  return (
    <Select
      aria-label="Campaign"
      allowDeselect={false}
      w={210}
      data={campaigns.map(({ id, created_at }, index) => ({
        value: id,
        label: `${index === 0 ? 'Newest' : 'Earlier'}: ${age(created_at, now)}`,
      }))}
      title={dateTime(campaign.created_at)}
      value={campaign.id}
      onChange={(id) => id && onChoose(id)}
    />
  )
}
