/** One arena of the gallery: its drawing, what it is, and the way to a training on it. */
import { ActionIcon, Button, Group, Skeleton, Slider, Text } from '@mantine/core'
import { useDebouncedValue } from '@mantine/hooks'
import { keepPreviousData } from '@tanstack/react-query'
import { useEffect, useRef, useState } from 'react'
import { Link } from 'react-router'
import { $api } from '../api/client'
import { messageOf } from '../api/errors'
import type { ArenaSummary, ArenaView } from '../api/types'
import { arenaFacts, drawOn, trainOn } from '../lib/arenas'
import classes from './ArenaCard.module.css'
import { ArenaDrawing } from './ArenaDrawing'
import { DeleteButton } from './DeleteButton'
import { AddToSuite } from './evaluations/AddToSuite'
import { evaluate, suiteInArena } from './evaluations/choices'
import { Hint } from './Hint'
import { IconPencil, IconPlus, IconRefresh } from './icons'

interface ArenaCardProps {
  arena: ArenaSummary
  /** Whether it was imported just now: then it comes on screen, and says so. */
  isNew?: boolean
  onDelete: (arena: ArenaSummary) => void
}

export function ArenaCard({ arena, isNew = false, onDelete }: ArenaCardProps) {
  switch (arena.kind) {
    case 'generated':
      return <FamilyCard arena={arena} />
    case 'imported':
      return <ImportedCard arena={arena} isNew={isNew} onDelete={onDelete} />
    case 'fixed':
      return <FixedCard arena={arena} />
  }
}

function FixedCard({ arena }: { arena: ArenaSummary }) {
  const { data, error } = $api.useQuery(
    'get',
    '/api/arenas/fixed',
    { params: { query: { name: arena.key as 'simple' | 'complex' } } },
    { staleTime: Number.POSITIVE_INFINITY },
  )
  return <Card title={arena.title} view={data} error={error} config={arena.config} />
}

function ImportedCard({ arena, isNew, onDelete }: Required<ArenaCardProps>) {
  const { data, error } = $api.useQuery(
    'get',
    '/api/arenas/imported/{sha256}',
    { params: { path: { sha256: arena.key } } },
    { staleTime: 60_000 },
  )
  const [adding, setAdding] = useState(false)
  return (
    <Card
      title={arena.title}
      isNew={isNew}
      view={data}
      error={error}
      config={arena.config}
      action={
        <>
          <Hint label="Add to a suite">
            <ActionIcon
              variant="subtle"
              color="gray"
              aria-label={`Add ${arena.title} to a suite`}
              onClick={() => setAdding(true)}
            >
              <IconPlus size={16} stroke={1.6} />
            </ActionIcon>
          </Hint>
          <DeleteButton name={arena.title} onClick={() => onDelete(arena)} />
          {adding && <AddToSuite title={arena.title} sha256={arena.key} onClose={() => setAdding(false)} />}
        </>
      }
    />
  )
}

function FamilyCard({ arena }: { arena: ArenaSummary }) {
  const [difficulty, setDifficulty] = useState(0.5)
  const [seed, setSeed] = useState(0)
  const [wanted] = useDebouncedValue(difficulty, 120)
  const { data, error } = $api.useQuery(
    'get',
    '/api/arenas/generated',
    { params: { query: { name: arena.key, difficulty: wanted, seed } } },
    { staleTime: Number.POSITIVE_INFINITY, placeholderData: keepPreviousData },
  )
  return (
    <Card
      title={arena.title}
      view={data}
      error={error}
      config={{ ...arena.config, difficulty, seed } as ArenaSummary['config']}
      action={
        <Hint label="Another map">
          <ActionIcon
            variant="subtle"
            color="gray"
            aria-label={`Another map of ${arena.title}`}
            onClick={() => setSeed(seed + 1)}
          >
            <IconRefresh size={16} stroke={1.6} />
          </ActionIcon>
        </Hint>
      }
    >
      <div className={classes.difficulty}>
        <Text size="xs" c="dimmed" component="span" aria-hidden>
          Difficulty
        </Text>
        <Slider
          className={classes.slider}
          size="sm"
          thumbLabel={`Difficulty of ${arena.title}`}
          min={0}
          max={1}
          step={0.05}
          label={null}
          value={difficulty}
          onChange={setDifficulty}
        />
        <Text size="xs" component="span" className={classes.value}>
          {difficulty.toFixed(2)}
        </Text>
      </div>
    </Card>
  )
}

interface CardProps {
  title: string
  isNew?: boolean
  view: ArenaView | undefined
  error: unknown
  config: ArenaSummary['config']
  action?: React.ReactNode
  children?: React.ReactNode
}

function Card({ title, isNew = false, view, error, config, action, children }: CardProps) {
  const card = useRef<HTMLLIElement>(null)
  useEffect(() => {
    if (isNew) card.current?.scrollIntoView({ block: 'center', behavior: 'smooth' })
  }, [isNew])
  return (
    <li ref={card} className={classes.card} data-testid="arena" data-new={isNew || undefined}>
      <div className={classes.picture}>
        {view ? (
          <ArenaDrawing geometry={view.geometry} label={`${title} from above`} />
        ) : error ? (
          <Text size="xs" c="dimmed" role="alert">
            {messageOf(error)}
          </Text>
        ) : (
          <Skeleton width="100%" height="100%" />
        )}
      </div>
      <Group justify="space-between" wrap="nowrap" gap={4} mt={8} mih={28}>
        <h3 className={classes.title}>{title}</h3>
        <Group gap={0} wrap="nowrap">
          <Hint label="Draw on a copy">
            <ActionIcon
              component={Link}
              to={drawOn(config)}
              variant="subtle"
              color="gray"
              aria-label={`Draw on a copy of ${title}`}
            >
              <IconPencil size={16} stroke={1.6} />
            </ActionIcon>
          </Hint>
          {action}
        </Group>
      </Group>
      <Text size="xs" c="dimmed" className={classes.facts}>
        {view ? arenaFacts(view) : ' '}
      </Text>
      {children}
      <Group gap={6} mt="auto" grow preventGrowOverflow={false}>
        <Button component={Link} to={trainOn(config)} variant="default" size="xs">
          Train on it
        </Button>
        <Button
          component={Link}
          to={evaluate([], [suiteInArena(config)])}
          variant="default"
          size="xs"
          aria-label={`Evaluate on ${title}`}
        >
          Evaluate
        </Button>
      </Group>
    </li>
  )
}
