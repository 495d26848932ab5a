/** Where a recording plays in 3D, once it is there; and the way to take it along. */
import { Button } from '@mantine/core'
import { type ComponentProps, type RefObject, useState } from 'react'
import { at } from '../../lib/base'
import { IconDownload } from '../icons'
import { QueryError } from '../ui'
import classes from './Replay.module.css'
import { Drawing, Waiting } from './Waiting'

interface StageProps {
  ref?: RefObject<HTMLDivElement | null>
  frame: RefObject<HTMLIFrameElement | null>
  testId: string
  /** What the recording is called aloud, and in an error. */
  title: string
  what: string
  /** The recording's page; none while it is made. */
  page: string | undefined
  /** Seconds at which it is. */
  time: number | null
  query: { error: ComponentProps<typeof QueryError>['error'] | null; refetch: () => unknown }
  progress: ComponentProps<typeof Waiting>['progress']
  /** Share of the picture that is drawn, where that is known. */
  drawn?: number | undefined
  onLoad?: () => void
}

export function Stage({
  ref,
  frame,
  testId,
  title,
  what,
  page,
  time,
  query,
  progress,
  drawn,
  onLoad,
}: StageProps) {
  const [loaded, setLoaded] = useState<string>()
  return (
    <div ref={ref} className={classes.stage} data-testid={testId}>
      {page ? (
        <>
          <iframe
            key={page}
            ref={frame}
            title={title}
            src={at(page)}
            allow="fullscreen"
            onLoad={() => {
              setLoaded(page)
              onLoad?.()
            }}
            data-testid={`${testId}-frame`}
            data-seconds={time ?? undefined}
          />
          {loaded !== page && time === null && <Drawing share={drawn} />}
        </>
      ) : query.error ? (
        <QueryError error={query.error} what={what} retry={() => void query.refetch()} />
      ) : (
        <Waiting progress={progress} />
      )}
    </div>
  )
}

/** The recording itself. */
export function DownloadPage({ page }: { page: string }) {
  return (
    <Button
      component="a"
      href={at(`${page}?download`)}
      download
      variant="default"
      size="xs"
      leftSection={<IconDownload size={14} />}
      title="One file that plays in any browser, without Mapless"
    >
      Download
    </Button>
  )
}
