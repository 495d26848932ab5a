/** Which tool draws, with what it takes to know; the grid, undo and redo. */
import { ActionIcon, Button, Checkbox, NumberInput, Select } from '@mantine/core'
import { Hint } from '../Hint'
import { IconArrowBackUp, IconArrowForwardUp } from '../icons'
import { Segments } from '../Segments'
import classes from './editor.module.css'
import { TOOLS, type Tool, type ToolSettings } from './tools'
import type { Draft } from './useDraft'

const GRIDS = [
  { value: '0', label: 'No grid' },
  { value: '0.05', label: 'Grid 0.05 m' },
  { value: '0.1', label: 'Grid 0.1 m' },
  { value: '0.25', label: 'Grid 0.25 m' },
  { value: '0.5', label: 'Grid 0.5 m' },
  { value: '1', label: 'Grid 1 m' },
]

interface ToolbarProps {
  draft: Draft
  tool: Tool
  setTool: (tool: Tool) => void
  settings: ToolSettings
  setSettings: (settings: ToolSettings) => void
  grid: number
  setGrid: (grid: number) => void
}

export function Toolbar({ draft, tool, setTool, grid, setGrid, ...rest }: ToolbarProps) {
  const help = TOOLS.find((each) => each.tool === tool)?.help
  return (
    <>
      <div className={classes.tools}>
        <fieldset className={`${classes.fieldset} ${classes.row}`} aria-label="Tools">
          {TOOLS.map((each) => (
            <Button
              key={each.tool}
              size="xs"
              variant={each.tool === tool ? 'filled' : 'default'}
              aria-pressed={each.tool === tool}
              onClick={() => setTool(each.tool)}
            >
              {each.label}
            </Button>
          ))}
        </fieldset>
        <div className={classes.row}>
          <Select
            size="xs"
            w={124}
            aria-label="Grid"
            allowDeselect={false}
            data={GRIDS}
            value={String(grid)}
            onChange={(value) => setGrid(Number(value))}
          />
          <Undoing label="Undo" act={draft.undo}>
            <IconArrowBackUp size={18} />
          </Undoing>
          <Undoing label="Redo" act={draft.redo}>
            <IconArrowForwardUp size={18} />
          </Undoing>
        </div>
      </div>
      <div className={classes.options}>
        <p>{help}</p>
        <Options tool={tool} {...rest} />
      </div>
    </>
  )
}

function Undoing({
  label,
  act,
  children,
}: {
  label: string
  act: (() => void) | null
  children: React.ReactNode
}) {
  return (
    <Hint label={label}>
      <ActionIcon
        variant="default"
        size={30}
        aria-label={label}
        disabled={act === null}
        onClick={() => act?.()}
      >
        {children}
      </ActionIcon>
    </Hint>
  )
}

function Options({ tool, settings, setSettings }: Pick<ToolbarProps, 'tool' | 'settings' | 'setSettings'>) {
  const metres = (name: 'thickness' | 'door', label: string, min: number, max: number) => (
    <NumberInput
      size="xs"
      w={112}
      label={label}
      min={min}
      max={max}
      step={0.05}
      decimalScale={2}
      clampBehavior="strict"
      value={settings[name]}
      onChange={(value) => typeof value === 'number' && setSettings({ ...settings, [name]: value })}
    />
  )
  switch (tool) {
    case 'wall':
      return metres('thickness', 'Thickness, m', 0.05, 2)
    case 'door':
      return (
        <>
          {metres('door', 'Door, m', 0.3, 4)}
          <Checkbox
            size="xs"
            label="It slides open and shut: a row of discs, as all that moves here"
            checked={settings.slides}
            onChange={(event) => setSettings({ ...settings, slides: event.currentTarget.checked })}
          />
        </>
      )
    case 'way':
      return (
        <Segments
          size="xs"
          aria-label="Who goes this way"
          value={settings.kind}
          onChange={(kind) => setSettings({ ...settings, kind })}
          data={[
            { value: 'pedestrian', label: 'Gives way' },
            { value: 'patrol', label: 'Waits and turns' },
          ]}
        />
      )
    default:
      return null
  }
}
