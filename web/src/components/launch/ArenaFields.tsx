/** Where a training drives: the settings of its arena beside a picture of it, in a place that stays as high whatever is chosen. */
import { useDebouncedValue } from '@mantine/hooks'
import type { ArenaConfig } from '../../api/types'
import type { Field } from '../../form/layout'
import { FieldGrid } from '../../form/SchemaForm'
import type { Json, Schema } from '../../form/schema'
import type { Form } from '../../form/useForm'
import { valueAt } from '../../form/values'
import { ArenaPicture } from '../ArenaPicture'
import classes from './launch.module.css'

const ARENA = ['training', 'task', 'arena']
/** While a number is being typed, no map of every digit is asked for. */
const REST_MS = 300

export const isOfArena = ({ path }: Field): boolean => ARENA.every((key, at) => path[at] === key)

interface ArenaFieldsProps {
  fields: readonly Field[]
  form: Form
  root: Schema
  initial: Json
}

export function ArenaFields(props: ArenaFieldsProps) {
  const arena = valueAt(props.form.values, ARENA) ?? null
  const [shown] = useDebouncedValue(isWhole(arena) ? arena : null, REST_MS)
  return (
    <div className={classes.arena}>
      <FieldGrid {...props} />
      <div className={classes.picture}>{shown && <ArenaPicture arena={shown} />}</div>
    </div>
  )
}

/** Whether enough is chosen to draw it. */
function isWhole(arena: Json): arena is Json & ArenaConfig {
  const at = (key: string) => valueAt(arena, [key])
  if (typeof at('name') !== 'string') return false
  const difficulty = at('difficulty')
  const seed = at('seed')
  return (
    (difficulty === undefined || (typeof difficulty === 'number' && difficulty >= 0 && difficulty <= 1)) &&
    (seed === undefined || (Number.isInteger(seed) && Number(seed) >= 0))
  )
}
