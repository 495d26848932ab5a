/** Where recordings are dropped, or chosen. */
import { Button, FileButton, Select, Stack, Text } from '@mantine/core'
import { useQueryClient } from '@tanstack/react-query'
import { useEffect, useState } from 'react'
import { useNavigate } from 'react-router'
import { api } from '../../api/client'
import { refusalOf } from '../../api/errors'
import { IconUpload } from '../icons'
import { useLaunchProject } from '../people/useLaunchProject'
import { Notice } from '../ui'
import classes from './recordings.module.css'

/** Larger ones are refused by the server anyway; these are not even sent. */
const MAX_BYTES = 32 * 2 ** 20

export function RecordingUpload() {
  const client = useQueryClient()
  const navigate = useNavigate()
  const { projects, project, choose } = useLaunchProject()
  const [over, setOver] = useState(false)
  const [sending, setSending] = useState(false)
  const [problem, setProblem] = useState<string>()

  const [chosen, setChosen] = useState<File>()

  const take = (file: File | null | undefined) => {
    if (!file) return
    setProblem(undefined)
    if (file.size > MAX_BYTES) {
      setProblem(
        `${file.name} is larger than 32 MiB. Record only what is needed: ros2 bag record /scan /odom /cmd_vel /goal_pose /tf /tf_static`,
      )
      return
    }
    setChosen(file)
  }

  const send = async (file: File, into: string) => {
    setSending(true)
    try {
      const { data } = await api.POST('/api/recordings', {
        params: { query: { name: file.name.slice(0, 120), project_id: into } },
        headers: { 'Content-Type': 'application/octet-stream' },
        body: file as unknown as string,
        bodySerializer: (body) => body as unknown as string,
      })
      await client.invalidateQueries({ queryKey: ['get', '/api/recordings'] })
      if (data) await navigate(`/recordings/${data.id}`)
    } catch (error) {
      setProblem(refusalOf(error))
    } finally {
      setSending(false)
    }
  }

  // Chosen before it is known which projects there are, it waits for them.
  // biome-ignore lint/correctness/useExhaustiveDependencies: a file is sent once.
  useEffect(() => {
    if (chosen === undefined || project === undefined) return
    setChosen(undefined)
    void send(chosen, project)
  }, [chosen, project])

  return (
    <Stack gap="sm">
      {/* biome-ignore lint/a11y/noStaticElementInteractions: the button inside does the same by keyboard. */}
      <div
        className={classes.drop}
        data-over={over}
        data-testid="drop"
        onDragOver={(event) => {
          event.preventDefault()
          setOver(true)
        }}
        onDragLeave={() => setOver(false)}
        onDrop={(event) => {
          event.preventDefault()
          setOver(false)
          take(event.dataTransfer.files[0])
        }}
      >
        <Stack gap="xs" align="center">
          <Text size="sm">
            Drop a recording here: an .mcap or a .db3 file, or the folder of a rosbag2 recording as .zip or
            .tar
          </Text>
          <FileButton accept=".mcap,.db3,.zip,.tar,.gz,.tgz" onChange={take}>
            {(props) => (
              <Button
                {...props}
                variant="default"
                leftSection={<IconUpload size={16} />}
                loading={sending || chosen !== undefined}
              >
                Choose a recording
              </Button>
            )}
          </FileButton>
          <Text size="xs" c="dimmed" maw="80ch">
            Scans (LaserScan) and odometry are needed; with commands (Twist or TwistStamped) delay and
            acceleration can be told, with /tf goals in a map's frame. Up to 32 MiB.
          </Text>
          {projects.length > 1 && (
            <Select
              size="xs"
              label="Project"
              allowDeselect={false}
              value={project ?? null}
              onChange={(next) => next !== null && choose(next)}
              data={projects.map((each) => ({ value: each.id, label: each.name }))}
            />
          )}
        </Stack>
      </div>
      {problem && (
        <Notice title="Refused" bad role="alert">
          {problem}
        </Notice>
      )}
    </Stack>
  )
}
