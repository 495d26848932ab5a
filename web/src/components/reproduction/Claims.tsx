/** The paper's claims, each with one of three words, the figures behind it, and what the paper's own can carry. */
import { Text } from '@mantine/core'
import type { Verdict } from '../../api/types'
import { Panel } from '../ui'
import ui from '../ui.module.css'
import classes from './reproduction.module.css'

const WORDS = ['holds', 'does not hold', "can't be told"] as const

export function Claims({ claims }: { claims: readonly Verdict[] }) {
  const told = WORDS.map((word) => `${claims.filter((claim) => claim.word === word).length} ${plural(word)}`)
  return (
    <Panel
      title="The paper's claims"
      actions={
        <Text size="xs" c="dimmed" data-testid="told">
          {told.join(' · ')}
        </Text>
      }
    >
      <ul className={classes.claims}>
        {claims.map((claim) => (
          <li key={claim.id} data-testid="claim" data-word={claim.word}>
            <span className={classes.word} data-word={claim.word}>
              {claim.word}
            </span>
            <div>
              <div className={classes.statement}>{claim.statement}</div>
              <Why ruling={claim} />
              {claim.other_way && (
                <div className={classes.other} data-testid="other-way" data-word={claim.other_way.word}>
                  <div>
                    With DDPG's logit penalty:{' '}
                    <span className={classes.word} data-word={claim.other_way.word}>
                      {claim.other_way.word}
                    </span>
                  </div>
                  <Why ruling={claim.other_way} />
                </div>
              )}
              <div className={ui.quiet}>{[claim.evidence, claim.reading].filter(Boolean).join(' ')}</div>
              <div className={`${ui.quiet} ${classes.source}`}>{claim.source}</div>
            </div>
          </li>
        ))}
      </ul>
      <Text size="xs" c="dimmed" mt="md" maw="100ch">
        A comparison is judged by the difference of two means over seeds and its 95 % interval, and not at all
        below five seeds; two are equivalent where the 90 % interval lies within a margin. The paper trained
        one seed of each: its effect is compatible inside our interval, and outside only as far as single
        seeds spread. DDPG is compared as it was published, and the other way with a penalty on its squared
        logits, which keeps it from saturating. With so many comparisons about one interval in twenty misses
        the truth.
      </Text>
    </Panel>
  )
}

function Why({ ruling }: { ruling: Pick<Verdict, 'reason' | 'compatibility'> }) {
  return (
    <>
      <div>{ruling.reason}</div>
      {ruling.compatibility && (
        <div data-testid="compatibility" data-word={ruling.compatibility.word}>
          {ruling.compatibility.sentence}
        </div>
      )}
    </>
  )
}

const plural = (word: Verdict['word']): string =>
  ({ holds: 'hold', 'does not hold': 'do not hold', "can't be told": "can't be told" })[word]
