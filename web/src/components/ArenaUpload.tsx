/** Importing an arena: choose files, see what came out of them, keep it. */
import { Button, FileButton, Group, Modal, Stack, Text } from '@mantine/core'
import { useQueryClient } from '@tanstack/react-query'
import { useState } from 'react'
import { $api } from '../api/client'
import { messageOf } from '../api/errors'
import type { ArenaView } from '../api/types'
import { HEADS } from '../heads'
import { arenaFacts } from '../lib/arenas'
import { filesForUpload, type UploadFile } from '../lib/upload'
import { ArenaDrawing } from './ArenaDrawing'
import classes from './ArenaUpload.module.css'
import { IconUpload } from './icons'
import { Notice } from './ui'

const ACCEPTED = '.yaml,.yml,.json,.world,.sdf,.pgm,.png,.cc'

interface ArenaUploadProps {
  /** Called with the hash of one that was kept. */
  onImported: (sha256: string) => void
}

export function ArenaUpload({ onImported }: ArenaUploadProps) {
  const client = useQueryClient()
  const [files, setFiles] = useState<UploadFile[]>([])
  const [preview, setPreview] = useState<ArenaView>()
  const [problem, setProblem] = useState<string>()
  const upload = $api.useMutation('post', '/api/arenas/imported')
  const close = () => {
    setPreview(undefined)
    setProblem(undefined)
  }

  const look = async (chosen: File[]) => {
    if (chosen.length === 0) return
    close()
    try {
      const read = await filesForUpload(chosen)
      setFiles(read)
      setPreview(await upload.mutateAsync({ body: { files: read, keep: false } }))
    } catch (error) {
      setProblem(messageOf(error))
    }
  }
  const keep = async () => {
    try {
      const { config } = await upload.mutateAsync({ body: { files, keep: true } })
      close()
      await client.invalidateQueries({ queryKey: ['get', '/api/arenas'] })
      if (config.name === 'imported') onImported(config.sha256)
    } catch (error) {
      setProblem(messageOf(error))
    }
  }

  return (
    <>
      <FileButton multiple accept={ACCEPTED} onChange={(chosen) => void look(chosen)}>
        {(props) => (
          <Button
            {...props}
            variant="default"
            leftSection={<IconUpload size={16} />}
            loading={upload.isPending && !preview}
          >
            Import arena
          </Button>
        )}
      </FileButton>
      <Modal
        opened={preview !== undefined || problem !== undefined}
        onClose={close}
        title={preview ? `Import “${preview.title}”?` : 'This file cannot be used'}
      >
        <Stack>
          {preview && (
            <>
              <div className={classes.picture}>
                <ArenaDrawing geometry={preview.geometry} label={`${preview.title} from above`} />
              </div>
              <Text size="sm" c="dimmed">
                {arenaFacts(preview)}
              </Text>
            </>
          )}
          {problem && (
            <Notice title="Refused" bad role="alert">
              {problem}
            </Notice>
          )}
          {problem && (
            <Text size="sm" c="dimmed">
              {HEADS.ArenasPage.about}
            </Text>
          )}
          <Group justify="flex-end">
            <Button variant="default" onClick={close}>
              {preview ? 'Cancel' : 'Close'}
            </Button>
            {preview && (
              <Button onClick={() => void keep()} loading={upload.isPending} data-autofocus>
                Import
              </Button>
            )}
          </Group>
        </Stack>
      </Modal>
    </>
  )
}
