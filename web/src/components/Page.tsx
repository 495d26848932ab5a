/** What every page stands in; of nothing but itself, since it is there before the pages' own code. */
import type { ReactNode } from 'react'
import { Link } from 'react-router'
import { partsOf, withinOf } from '../heads'
import { at } from '../lib/base'

/** A page's frame: its title on the left, what can be done on the right. */
export function Page({
  title,
  about,
  above,
  below,
  actions,
  children,
}: {
  title: ReactNode
  /** What it is for, as `heads` has it. */
  about?: string | undefined
  above?: ReactNode
  below?: ReactNode
  actions?: ReactNode
  children: ReactNode
}) {
  return (
    <div className="frame-page">
      <div className="frame-top">
        <div className="frame-text">
          {above}
          <h1>{title}</h1>
          {about && <About text={about} />}
          {below}
        </div>
        {actions}
      </div>
      {children}
    </div>
  )
}

/** What a page is one of, as its HTML has it (frame.ts), and what else leads to it. */
export function Within({ page, children }: { page: string; children?: ReactNode }) {
  const [above, to] = withinOf(page) ?? []
  return (
    <p className="frame-above">
      {to && <Link to={to}>{above}</Link>}
      {children}
    </p>
  )
}

/** As the HTML has it (frame.ts). */
function About({ text }: { text: string }) {
  return (
    <p className="frame-about">
      {partsOf(text).map(({ text: said, to, code }) =>
        code ? (
          <code key={said}>{said}</code>
        ) : to?.startsWith('/api/') ? (
          <a key={said} href={at(to)}>
            {said}
          </a>
        ) : to ? (
          <Link key={said} to={to}>
            {said}
          </Link>
        ) : (
          said
        ),
      )}
    </p>
  )
}
