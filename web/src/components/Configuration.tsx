/** A training's settings: first what differs from the defaults, the rest on demand. */
import { Accordion } from '@mantine/core'
import { $api } from '../api/client'
import type { TrainingConfig } from '../api/types'
import { type Field, fieldsOf, grouped, initialOf } from '../form/layout'
import type { Json, Schema } from '../form/schema'
import { settingText } from '../form/settingText'
import { sameValue, valueAt } from '../form/values'
import classes from './Configuration.module.css'

export function Configuration({ training }: { training: TrainingConfig }) {
  const { data } = $api.useQuery('get', '/api/training/form', undefined, {
    staleTime: Number.POSITIVE_INFINITY,
  })
  if (!data) return <div style={{ minHeight: 60 }} />
  const values = { training } as unknown as Json
  const defaults = data.defaults as unknown as Json
  const schema = data.schema as Schema
  const fields = fieldsOf(schema, schema, values).filter((field) => field.path[0] === 'training')
  const settingOf = (field: Field) =>
    valueAt(values, field.kind === 'union' ? [...field.path, field.tag] : field.path) ?? null
  const defaultOf = (field: Field) =>
    field.kind === 'union'
      ? valueAt(defaults, [...field.path, field.tag])
      : initialOf(field, values, defaults)
  const changed = fields.filter((field) => !sameValue(settingOf(field), defaultOf(field)))
  return (
    <>
      {changed.length === 0 ? (
        <p className={classes.note}>Every setting has its default.</p>
      ) : (
        <>
          <p className={classes.note}>Differs from the defaults in:</p>
          <Settings fields={changed} settingOf={settingOf} defaultOf={defaultOf} />
        </>
      )}
      <Accordion variant="default" mt="xs" className={classes.all}>
        <Accordion.Item value="all">
          <Accordion.Control>All settings</Accordion.Control>
          <Accordion.Panel>
            {grouped(fields).map(([heading, some]) => (
              <section key={heading}>
                <h3 className={classes.heading}>{heading}</h3>
                <Settings fields={some} settingOf={settingOf} />
              </section>
            ))}
          </Accordion.Panel>
        </Accordion.Item>
      </Accordion>
    </>
  )
}

interface SettingsProps {
  fields: readonly Field[]
  settingOf: (field: Field) => Json
  defaultOf?: (field: Field) => Json | undefined
}

function Settings({ fields, settingOf, defaultOf }: SettingsProps) {
  return (
    <dl className={classes.settings}>
      {fields.map((field) => (
        <div key={field.key}>
          <dt>{field.label}</dt>
          <dd>
            {settingText(settingOf(field))}
            {defaultOf && defaultOf(field) !== undefined && (
              <span>default {settingText(defaultOf(field))}</span>
            )}
          </dd>
        </div>
      ))}
    </dl>
  )
}
