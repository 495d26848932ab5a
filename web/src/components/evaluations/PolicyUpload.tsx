/** A policy from elsewhere: an ONNX file, or a robot bundle of this project. */
import { Button, FileButton, Group, Modal, Select, Stack, Text, TextInput } from '@mantine/core'
import { useQueryClient } from '@tanstack/react-query'
import { useState } from 'react'
import { useNavigate } from 'react-router'
import { $api, api } from '../../api/client'
import { messageOf, refusalOf } from '../../api/errors'
import { filesForUpload, type UploadFile } from '../../lib/upload'
import { IconUpload } from '../icons'
import { useLaunchProject } from '../people/useLaunchProject'
import { Notice } from '../ui'
import { evaluate, policyKey } from './choices'

export function PolicyUpload() {
  const client = useQueryClient()
  const navigate = useNavigate()
  const { projects, project, choose } = useLaunchProject()
  const [file, setFile] = useState<UploadFile>()
  const [name, setName] = useState('')
  const [like, setLike] = useState<string | null>(null)
  const [problem, setProblem] = useState<string>()
  const upload = $api.useMutation('post', '/api/uploads')
  const shipped = $api.useQuery('get', '/api/policies', {}, { enabled: file !== undefined })
  const trainings = $api.useQuery(
    'get',
    '/api/experiments',
    { params: { query: { limit: 50 } } },
    { enabled: file !== undefined },
  )
  const bundle = file?.name.toLowerCase().endsWith('.zip') ?? false
  const close = () => {
    setFile(undefined)
    setProblem(undefined)
  }

  const take = async (chosen: File | null) => {
    if (!chosen) return
    setProblem(undefined)
    setName(chosen.name.replace(/\.(onnx|zip)$/i, ''))
    try {
      setFile((await filesForUpload([chosen]))[0])
    } catch (error) {
      setProblem(messageOf(error))
    }
  }

  /** Robot, LiDAR and observation of the policy or the training that was chosen. */
  const task = async () => {
    if (like === null) return null
    const [source, id = ''] = like.split(':')
    if (source === 'shipped') return shipped.data?.find((each) => each.name === id)?.training.task ?? null
    const { data } = await api.GET('/api/experiments/{experiment_id}', {
      params: { path: { experiment_id: id } },
    })
    return data?.training.task ?? null
  }

  const send = async () => {
    if (!file || !project) return
    setProblem(undefined)
    try {
      const kept = await upload.mutateAsync({
        body: { name, project_id: project, content: file.content, task: bundle ? null : await task() },
      })
      close()
      await client.invalidateQueries({ queryKey: ['get', '/api/uploads'] })
      await navigate(evaluate([policyKey('uploaded', kept.id)]))
    } catch (error) {
      setProblem(refusalOf(error))
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
      >
        <Stack
          component="form"
          onSubmit={(event) => {
            event.preventDefault()
            void send()
          }}
        >
          {file && (
            <>
              <TextInput
                label="Name"
                maxLength={120}
                required
                data-autofocus
                value={name}
                onChange={(event) => setName(event.currentTarget.value)}
              />
              {bundle ? (
                <Text size="sm" c="dimmed">
                  A robot bundle says itself which robot, LiDAR and observation it is for.
                </Text>
              ) : (
                <Select
                  label="Robot, LiDAR and observation as of"
                  description="Input “observation” (n, numbers), output “action” (n, A) in fractions of the robot's limits."
                  placeholder="A policy or a training"
                  searchable
                  required
                  value={like}
                  onChange={setLike}
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
            </>
          )}
          {problem && (
            <Notice title="Refused" bad role="alert">
              {problem}
            </Notice>
          )}
          <Group justify="flex-end">
            <Button variant="default" onClick={close}>
              {file ? 'Cancel' : 'Close'}
            </Button>
            {file && (
              <Button
                type="submit"
                loading={upload.isPending}
                disabled={name.trim() === '' || project === undefined || !(bundle || like)}
              >
                Upload
              </Button>
            )}
          </Group>
        </Stack>
      </Modal>
    </>
  )
}
