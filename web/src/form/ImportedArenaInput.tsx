/** Which imported arena, chosen by its name. */
import { Anchor, Select } from '@mantine/core'
import { Link } from 'react-router'
import { $api } from '../api/client'
import { messageOf } from '../api/errors'

interface ImportedArenaInputProps {
  id: string
  label: string
  error: string | undefined
  /** The hash of its geometry, "" for none. */
  value: string
  onChange: (sha256: string) => void
}

export function ImportedArenaInput({ value, onChange, ...common }: ImportedArenaInputProps) {
  const { data, error } = $api.useQuery('get', '/api/arenas')
  const imported = (data ?? []).filter(({ kind }) => kind === 'imported')
  const known = imported.some(({ key }) => key === value)
  return (
    <Select
      {...common}
      placeholder="Search by name"
      searchable
      allowDeselect={false}
      nothingFoundMessage={error ? messageOf(error) : 'None by that name'}
      description={
        <>
          Another one is imported on the page{' '}
          <Anchor component={Link} to="/arenas" inherit>
            Arenas
          </Anchor>
          .
        </>
      }
      inputWrapperOrder={['label', 'input', 'error', 'description']}
      data={[
        ...imported.map(({ key, title }) => ({ value: key, label: title })),
        ...(data && value && !known ? [{ value, label: 'One that is not here any more' }] : []),
      ]}
      value={value || null}
      onChange={(next) => next !== null && onChange(next)}
    />
  )
}
