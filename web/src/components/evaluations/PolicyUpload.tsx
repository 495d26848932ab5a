/** A policy from elsewhere: an ONNX file with what it is for, or a robot bundle of this project, which says that itself. */
import { Button, FileButton, Group, Modal, Select, Skeleton, Stack, Text, TextInput } from '@mantine/core'
import { useQueryClient } from '@tanstack/react-query'
import { useEffect, useRef, useState } from 'react'
import { useNavigate } from 'react-router'
import { $api, api } from '../../api/client'
import { ApiError, messageOf, refusalOf } from '../../api/errors'
import { faultsOf } from '../../form/faults'
import type { Json, Schema } from '../../form/schema'
import { useForm } from '../../form/useForm'
import { valueAt } from '../../form/values'
import { filesForUpload, type UploadFile } from '../../lib/upload'
import { IconUpload } from '../icons'
import { useLaunchProject } from '../people/useLaunchProject'
import { Notice, QueryError } from '../ui'
import { evaluate, policyKey } from './choices'
import { PolicyTaskFields, type Task, taskFields } from './PolicyTaskFields'

/** Room for three columns of fields. */
const WIDE = 940

const isBundle = (file: UploadFile): boolean => file.name.toLowerCase().endsWith('.zip')

export function PolicyUpload() {
  const [file, setFile] = useState<UploadFile>()
  const [problem, setProblem] = useState<string>()
  const wide = file !== undefined && !isBundle(file)
  const training = $api.useQuery('get', '/api/training/form', undefined, {
    enabled: wide,
    staleTime: Number.POSITIVE_INFINITY,
  })
  const close = () => {
    setFile(undefined)
    setProblem(undefined)
  }

  const take = async (chosen: File | null) => {
    if (!chosen) return
    setProblem(undefined)
    try {
      setFile((await filesForUpload([chosen]))[0])
    } catch (error) {
      setProblem(messageOf(error))
    }
  }

  return (
    <>
      <FileButton accept=".onnx,.zip" onChange={(chosen) => void take(chosen)}>
        {(props) => (
          <Button {...props} variant="default" leftSection={<IconUpload size={16} />}>
            Upload a policy
          </Button>
        )}
      </FileButton>
      <Modal
        opened={file !== undefined || problem !== undefined}
        onClose={close}
        title={file ? `Upload ${file.name}` : 'This file cannot be used'}
        size={wide ? WIDE : 'md'}
      >
        {problem && (
          <Stack>
            <Notice title="Refused" bad role="alert">
              {problem}
            </Notice>
            <Group justify="flex-end">
              <Button variant="default" onClick={close}>
                Close
              </Button>
            </Group>
          </Stack>
        )}
        {file && !wide && (
          <UploadForm key={file.name} file={file} root={null} initial={null} onClose={close} />
        )}
        {wide &&
          (training.data ? (
            <UploadForm
              key={file.name}
              file={file}
              root={training.data.schema as Schema}
              initial={{
                task: valueAt(training.data.defaults as unknown as Json, ['training', 'task']) ?? null,
              }}
              onClose={close}
            />
          ) : training.error ? (
            <QueryError error={training.error} what="form" retry={training.refetch} />
          ) : (
            <Skeleton height={320} aria-busy="true" aria-label="Loading the form" />
          ))}
      </Modal>
    </>
  )
}

interface UploadFormProps {
  file: UploadFile
  /** The schema of a new training, whose fields say what the file is for; null where it says that itself. */
  root: Schema | null
  initial: Json
  onClose: () => void
}

function UploadForm({ file, root, initial, onClose }: UploadFormProps) {
  const client = useQueryClient()
  const navigate = useNavigate()
  const { projects, project, choose } = useLaunchProject()
  const [name, setName] = useState(file.name.replace(/\.(onnx|zip)$/i, ''))
  const [problem, setProblem] = useState<string>()
  const upload = $api.useMutation('post', '/api/uploads')
  const refusal = useRef<HTMLDivElement>(null)
  useEffect(() => {
    if (problem) refusal.current?.scrollIntoView({ block: 'center' })
  }, [problem])
  const form = useForm(initial)
  const fields = root ? taskFields(root, form.values) : []
  const faulty = root !== null && Object.keys(faultsOf(fields, root, form.values)).length > 0

  const send = async () => {
    if (!project) return
    setProblem(undefined)
    try {
      const task = root ? (valueAt(form.values, ['task']) as unknown as Task) : null
      const kept = await upload.mutateAsync({
        body: { name, project_id: project, content: file.content, task },
      })
      onClose()
      await client.invalidateQueries({ queryKey: ['get', '/api/uploads'] })
      await navigate(evaluate([policyKey('uploaded', kept.id)]))
    } catch (error) {
      if (error instanceof ApiError) form.refuse(error.problems)
      setProblem(refusalOf(error))
    }
  }

  return (
    <Stack
      component="form"
      aria-label="Upload a policy"
      onSubmit={(event) => {
        event.preventDefault()
        void send()
      }}
    >
      <TextInput
        label="Name"
        maxLength={120}
        required
        data-autofocus
        value={name}
        onChange={(event) => setName(event.currentTarget.value)}
      />
      {root ? (
        <>
          <AsOf onTask={(task) => form.replace({ task: task as unknown as Json })} onProblem={setProblem} />
          <PolicyTaskFields form={form} fields={fields} root={root} initial={initial} />
        </>
      ) : (
        <Text size="sm" c="dimmed">
          A robot bundle says itself which robot, LiDAR and observation it is for.
        </Text>
      )}
      {projects.length > 1 && (
        <Select
          label="Project"
          allowDeselect={false}
          value={project ?? null}
          onChange={(next) => next !== null && choose(next)}
          data={projects.map((each) => ({ value: each.id, label: each.name }))}
        />
      )}
      <div ref={refusal}>
        {problem && (
          <Notice title="Refused" bad role="alert">
            {problem}
          </Notice>
        )}
      </div>
      <Group justify="flex-end">
        <Button variant="default" onClick={onClose}>
          Cancel
        </Button>
        <Button
          type="submit"
          loading={upload.isPending}
          disabled={name.trim() === '' || project === undefined || faulty}
        >
          Upload
        </Button>
      </Group>
    </Stack>
  )
}

interface AsOfProps {
  onTask: (task: Task) => void
  onProblem: (problem: string) => void
}

/** Fills the fields in with what a policy or a training has. */
function AsOf({ onTask, onProblem }: AsOfProps) {
  const [like, setLike] = useState<string | null>(null)
  const shipped = $api.useQuery('get', '/api/policies')
  const trainings = $api.useQuery('get', '/api/experiments', { params: { query: { limit: 50 } } })

  const fill = async (chosen: string) => {
    setLike(chosen)
    const [source, id = ''] = chosen.split(':')
    try {
      if (source === 'shipped') {
        const policy = shipped.data?.find((each) => each.name === id)
        if (policy) onTask(policy.training.task)
        return
      }
      const { data } = await api.GET('/api/experiments/{experiment_id}', {
        params: { path: { experiment_id: id } },
      })
      if (data) onTask(data.training.task)
    } catch (error) {
      onProblem(messageOf(error))
    }
  }

  return (
    <Select
      label="As of"
      description="Fills in below what a policy or a training has; each can be changed after that."
      placeholder="A policy or a training"
      searchable
      maw={420}
      inputWrapperOrder={['label', 'input', 'error', 'description']}
      value={like}
      onChange={(chosen) => chosen !== null && void fill(chosen)}
      data={[
        {
          group: 'Your trainings',
          items: (trainings.data?.items ?? []).map((each) => ({
            value: `training:${each.id}`,
            label: each.name,
          })),
        },
        {
          group: 'Shipped',
          items: (shipped.data ?? []).map((each) => ({
            value: `shipped:${each.name}`,
            label: each.title,
          })),
        },
      ]}
    />
  )
}
