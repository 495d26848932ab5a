/** The server's look at what is drawn: what would be refused, where a robot does not get to. */
import { Loader, NumberInput, Text } from '@mantine/core'
import { messageOf } from '../../api/errors'
import type { ArenaReview } from '../../api/types'
import { percent } from '../../lib/format'
import { Notice, Panel } from '../ui'
import classes from './editor.module.css'

interface FoundProps {
  review: ArenaReview | undefined
  /** Whether it is of what is drawn now. */
  current: boolean
  error: unknown
  clearance: number
  setClearance: (metres: number) => void
}

export function Found({ review, current, error, clearance, setClearance }: FoundProps) {
  return (
    <Panel title="Looked over" actions={current || error ? null : <Loader size={14} aria-hidden />}>
      <div role="status" data-testid="review" data-current={current}>
        {error ? (
          <Notice title="Not looked over" bad>
            {messageOf(error)}
          </Notice>
        ) : !review ? (
          <Text size="sm" c="dimmed">
            Looking it over…
          </Text>
        ) : (
          <>
            {review.remarks.length === 0 ? (
              <Text size="sm">All is well: nothing is closed off, nothing stands in the way.</Text>
            ) : (
              <ol className={classes.remarks}>
                {review.remarks.map(({ text, refused }, index) => (
                  <li key={text}>
                    <span className={classes.number} data-refused={refused}>
                      {index + 1}
                    </span>
                    <span>{text}</span>
                  </li>
                ))}
              </ol>
            )}
            <Text size="xs" c="dimmed" mt={8}>
              {review.free_area} m² in one piece, {percent(review.free_share)} of the floor.
            </Text>
          </>
        )}
      </div>
      <NumberInput
        mt="sm"
        size="xs"
        label="Room around the robot's middle, m"
        description="The Burger: 0.2"
        min={0.05}
        max={2}
        step={0.05}
        decimalScale={2}
        clampBehavior="blur"
        value={clearance}
        onChange={(value) => typeof value === 'number' && value >= 0.05 && value <= 2 && setClearance(value)}
      />
    </Panel>
  )
}
