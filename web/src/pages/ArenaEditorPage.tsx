/** An arena is drawn, looked over while it is, kept, and trained on. */
import { Button, Text, VisuallyHidden } from '@mantine/core'
import { useDebouncedValue, useLocalStorage } from '@mantine/hooks'
import { keepPreviousData } from '@tanstack/react-query'
import { startTransition, useEffect, useState } from 'react'
import { Link, useSearchParams } from 'react-router'
import { $api } from '../api/client'
import { messageOf } from '../api/errors'
import type { ArenaConfig } from '../api/types'
import { Canvas } from '../components/arena-editor/Canvas'
import { Chosen } from '../components/arena-editor/Chosen'
import classes from '../components/arena-editor/editor.module.css'
import { Found } from '../components/arena-editor/Found'
import { geometryOf } from '../components/arena-editor/geometryOf'
import { Keeping } from '../components/arena-editor/Keeping'
import { StartFrom } from '../components/arena-editor/StartFrom'
import { Toolbar } from '../components/arena-editor/Toolbar'
import type { Tool, ToolSettings } from '../components/arena-editor/tools'
import { type Draft, useDraft } from '../components/arena-editor/useDraft'
import { useGestures } from '../components/arena-editor/useGestures'
import { useKeys, useUndoKeys } from '../components/arena-editor/useKeys'
import { useView } from '../components/arena-editor/useView'
import { Notice, Page, Panel } from '../components/ui'
import { HEADS } from '../heads'
import { arenaFromSearch } from '../lib/arenas'
import { useTitle } from '../lib/hooks'

/** After the last change: the server looks at no mouse move. */
const REST_MS = 500

/** Metres that the default robot needs around its middle. */
const BURGER = 0.2

const SETTINGS: ToolSettings = { thickness: 0.1, door: 1, slides: false, kind: 'pedestrian' }

export function ArenaEditorPage() {
  useTitle(HEADS.ArenaEditorPage.title)
  const draft = useDraft()
  const [starting, setStarting] = useState(false)
  const [tool, setTool] = useState<Tool>('select')
  const [settings, setSettings] = useState(SETTINGS)
  const [grid, setGrid] = useLocalStorage({ key: 'mapless-arena-grid', defaultValue: 0.25 })
  const [said, say] = useState('')
  const view = useView(draft.arena)
  const gestures = useGestures({ draft, view, tool, settings, grid, say })
  const onKeyDown = useKeys({ draft, view, tool, setTool, grid, gestures, say })
  const problem = useFrom(draft)
  const [clearance, setClearance] = useState(BURGER)
  const { review, current, error } = useReview(draft, clearance)
  useUndoKeys(draft)
  const choose = (next: Tool) => {
    gestures.cancel()
    say('')
    setTool(next)
  }
  const remarks = review?.remarks ?? []
  return (
    <Page
      {...HEADS.ArenaEditorPage}
      actions={
        <div className={classes.row}>
          <Button variant="default" onClick={() => setStarting(true)}>
            Start from…
          </Button>
          <Button component={Link} to="/arenas" variant="default">
            All arenas
          </Button>
        </div>
      }
    >
      {problem && (
        <Notice title="This arena could not be loaded" bad role="alert">
          {problem}
        </Notice>
      )}
      <div className={classes.editor}>
        <Panel flush>
          <Toolbar
            draft={draft}
            tool={tool}
            setTool={choose}
            settings={settings}
            setSettings={setSettings}
            grid={grid}
            setGrid={setGrid}
          />
          <Canvas
            view={view}
            tool={tool}
            grid={grid}
            gestures={gestures}
            remarks={current ? remarks : []}
            onKeyDown={onKeyDown}
          />
          <div className={classes.foot}>
            <div className={classes.row}>
              <Button size="compact-xs" variant="default" onClick={() => view.zoomBy(1.5)}>
                Closer
              </Button>
              <Button
                size="compact-xs"
                variant="default"
                disabled={view.zoom === 1}
                onClick={() => view.zoomBy(1 / 1.5)}
              >
                Further
              </Button>
              {gestures.drawing && tool === 'way' && (
                <Button size="compact-xs" onClick={() => gestures.endWay()}>
                  End the way
                </Button>
              )}
            </div>
            <Text size="xs" c="dimmed" id="editor-keys">
              Keys: arrows move (Shift: further), R turns, N and P choose the next and the one before, Enter
              draws with the tool, Delete takes away, Ctrl+D duplicates, + and − look closer, Esc leaves.
            </Text>
            <VisuallyHidden aria-live="polite">{said}</VisuallyHidden>
          </div>
          {said && (tool === 'door' || tool === 'way') && (
            <Text size="xs" px={14} pb={8} c="orange.9" aria-hidden>
              {said}
            </Text>
          )}
        </Panel>
        <div className={classes.side}>
          <Keeping draft={draft} refused={current && remarks.some(({ refused }) => refused)} />
          <Chosen draft={draft} grid={grid} />
          <Found
            review={review}
            current={current}
            error={error}
            clearance={clearance}
            setClearance={setClearance}
          />
        </div>
      </div>
      <StartFrom
        opened={starting}
        onClose={() => setStarting(false)}
        onStart={(arena) => draft.change(arena, { chosen: null })}
      />
    </Page>
  )
}

/** Begins with the arena of the address, once: reloaded, the page goes on with what was drawn since. */
function useFrom({ change }: Draft): string | null {
  const [search, setSearch] = useSearchParams()
  const [problem, setProblem] = useState<string | null>(null)
  const text = search.get('from')
  useEffect(() => {
    const config = arenaFromSearch(text)
    if (config === null) return
    let left = false
    geometryOf(config as unknown as ArenaConfig).then(
      (arena) => {
        if (left) return
        startTransition(() => {
          change(arena, { chosen: null })
          setSearch({}, { replace: true })
        })
      },
      (error: unknown) => !left && setProblem(messageOf(error)),
    )
    return () => {
      left = true
    }
  }, [text, change, setSearch])
  return problem
}

/** The server's look at what is drawn, once it rests. */
function useReview({ arena }: Draft, clearance: number) {
  const [drawn] = useDebouncedValue(arena, REST_MS)
  const body = { arena: { ...drawn, name: drawn.name.trim() || 'Drawing' }, clearance }
  const { data, error, isPlaceholderData } = $api.useQuery(
    'post',
    '/api/arenas/reviews',
    { body },
    { placeholderData: keepPreviousData, staleTime: Number.POSITIVE_INFINITY, gcTime: 0 },
  )
  return { review: data, current: drawn === arena && data !== undefined && !isPlaceholderData, error }
}
