/** What a page becomes when its code throws: the reason, and a way on. Needs nothing that may be missing itself. */
import { Component, type ReactNode } from 'react'
import { messageOf } from '../api/errors'
import { useTitle } from '../lib/hooks'
import classes from './Shell.module.css'

interface BoundaryProps {
  /** Where it is: what broke one page does not break the next. */
  at: string
  children: ReactNode
}

export class Boundary extends Component<BoundaryProps, { broken: boolean; error?: unknown }> {
  override state: { broken: boolean; error?: unknown } = { broken: false }

  static getDerivedStateFromError = (error: unknown) => ({ broken: true, error })

  override componentDidUpdate({ at }: BoundaryProps) {
    if (this.state.broken && at !== this.props.at) this.setState({ broken: false })
  }

  override render() {
    return this.state.broken ? <Broken error={this.state.error} /> : this.props.children
  }
}

function Broken({ error }: { error: unknown }) {
  useTitle('Something broke')
  return (
    <div className={classes.broken} role="alert">
      <h1>This page broke</h1>
      <p>
        Trainings are not affected. <code>{messageOf(error)}</code>
      </p>
      <button type="button" onClick={() => window.location.reload()}>
        Reload
      </button>
    </div>
  )
}
