/** Until a page's code has come its head stands there, as it stood in the HTML. */
import { matchPath } from 'react-router'
import { headOf, nameOf } from '../heads'
import { earlyHead } from '../lib/early'
import { ROUTES } from '../routes'
import { Page, Within } from './Page'

/** The name of the page at an address. */
export const pageAt = (at: string): string | undefined =>
  Object.entries(ROUTES).find(([path]) => matchPath(path, at))?.[1]

export function Coming({ page }: { page: string | undefined }) {
  const head = page && headOf(page)
  const name = page && nameOf(page)
  return (
    <div aria-busy="true">
      {head && (
        <Page title={head.title} about={head.about} above={head.within && <Within page={page} />}>
          <span />
        </Page>
      )}
      {name && (
        <Page title={earlyHead().title} about={earlyHead().about} above={<Within page={page} />}>
          <span />
        </Page>
      )}
    </div>
  )
}
