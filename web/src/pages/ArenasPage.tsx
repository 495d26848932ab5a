/** The gallery: every arena drawn, with the way to a training on it. */
import { Button, Group, Modal, Skeleton, Stack, Text, TextInput } from '@mantine/core'
import { useQueryClient } from '@tanstack/react-query'
import { useState } from 'react'
import { Link } from 'react-router'
import { $api } from '../api/client'
import { messageOf } from '../api/errors'
import type { ArenaSummary } from '../api/types'
import { ArenaCard } from '../components/ArenaCard'
import { ArenaUpload } from '../components/ArenaUpload'
import { Below } from '../components/Below'
import { IconPencil, IconSearch } from '../components/icons'
import { Notice, Page, Panel, QueryError } from '../components/ui'
import { HEADS } from '../heads'
import { useTitle } from '../lib/hooks'
import classes from './ArenasPage.module.css'

/** One's own first: whoever imports one sees it. */
const SECTIONS = [
  { kind: 'imported', title: 'Imported', text: 'Read from files or drawn, the newest first.' },
  { kind: 'fixed', title: 'Built in', text: 'The two arenas of the paper.' },
  {
    kind: 'generated',
    title: 'Generated',
    text: 'A training meets a pool of different maps like the one shown; evaluations use maps that no training has seen.',
  },
] as const

/** Imported arenas that are drawn at first: each is a request of its own. */
const FIRST = 24
/** Pixels, about. */
const CARD_HEIGHT = 330

export function ArenasPage() {
  useTitle(HEADS.ArenasPage.title)
  const { data, error, refetch } = $api.useQuery('get', '/api/arenas')
  const [newest, setNewest] = useState<string>()
  const [deleting, setDeleting] = useState<ArenaSummary>()
  return (
    <Page
      {...HEADS.ArenasPage}
      actions={
        <Group gap="xs">
          <Button component={Link} to="/arenas/draw" leftSection={<IconPencil size={16} />}>
            Draw an arena
          </Button>
          <ArenaUpload onImported={setNewest} />
        </Group>
      }
    >
      {error && !data ? (
        <Panel>
          <QueryError error={error} what="list of arenas" retry={refetch} />
        </Panel>
      ) : !data ? (
        <div className={classes.grid} aria-busy="true">
          {SECTIONS.map(({ kind }) => (
            <Skeleton key={kind} height={CARD_HEIGHT} />
          ))}
        </div>
      ) : (
        SECTIONS.map(({ kind, title, text }) => (
          <Section
            key={kind}
            title={title}
            text={text}
            arenas={data
              .filter((arena) => arena.kind === kind)
              .sort((one, other) => (other.imported_at ?? 0) - (one.imported_at ?? 0))}
            newest={newest}
            onDelete={setDeleting}
          />
        ))
      )}
      {deleting && <DeleteDialog arena={deleting} onClose={() => setDeleting(undefined)} />}
    </Page>
  )
}

interface SectionProps {
  title: string
  text: string
  arenas: readonly ArenaSummary[]
  /** The key of the one that was imported just now. */
  newest: string | undefined
  onDelete: (arena: ArenaSummary) => void
}

function Section({ title, text, arenas, newest, onDelete }: SectionProps) {
  const [shown, setShown] = useState(FIRST)
  const [query, setQuery] = useState('')
  const found = arenas.filter((arena) => arena.title.toLowerCase().includes(query.trim().toLowerCase()))
  if (arenas.length === 0) return null
  return (
    <section className={classes.section} aria-label={title}>
      <Group justify="space-between" align="flex-end" mb={10}>
        <div>
          <h2 className={classes.heading}>{title}</h2>
          <Text size="sm" c="dimmed">
            {text}
          </Text>
        </div>
        {arenas.length > FIRST && (
          <TextInput
            aria-label="Search imported arenas by name"
            placeholder="Search by name"
            leftSection={<IconSearch size={16} />}
            value={query}
            onChange={(event) => setQuery(event.currentTarget.value)}
          />
        )}
      </Group>
      <ul className={classes.grid}>
        {found.slice(0, shown).map((arena) => (
          <Below key={arena.key} as="li" height={CARD_HEIGHT} now={arena.key === newest}>
            <ArenaCard arena={arena} isNew={arena.key === newest} onDelete={onDelete} />
          </Below>
        ))}
      </ul>
      {found.length > shown && (
        <Group justify="center" mt="md">
          <Button variant="default" onClick={() => setShown(shown + FIRST)}>
            Show more of {found.length} arenas
          </Button>
        </Group>
      )}
    </section>
  )
}

function DeleteDialog({ arena, onClose }: { arena: ArenaSummary; onClose: () => void }) {
  const client = useQueryClient()
  const remove = $api.useMutation('delete', '/api/arenas/imported/{sha256}', {
    onSuccess: async () => {
      onClose()
      await client.invalidateQueries({ queryKey: ['get', '/api/arenas'] })
    },
  })
  return (
    <Modal opened onClose={onClose} title={`Delete “${arena.title}”?`}>
      <Stack>
        <Text size="sm">It is gone then; an arena from a file can be imported again.</Text>
        {remove.error && (
          <Notice title="Not deleted" bad role="alert">
            {messageOf(remove.error)}
          </Notice>
        )}
        <Group justify="flex-end">
          <Button variant="default" onClick={onClose} data-autofocus>
            Keep
          </Button>
          <Button
            color="red"
            loading={remove.isPending}
            onClick={() => remove.mutate({ params: { path: { sha256: arena.key } } })}
          >
            Delete
          </Button>
        </Group>
      </Stack>
    </Modal>
  )
}
