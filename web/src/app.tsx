/** The routes; each page is a bundle of its own, loaded when it is first opened. */
import { type ComponentType, lazy, useEffect, useState } from 'react'
import { Route, Routes } from 'react-router'
import { Coming } from './components/Coming'
import { Shell } from './components/Shell'
import { lazily } from './lib/lazily'
import { ROUTES } from './routes'

const code = import.meta.glob<Record<string, ComponentType>>('./pages/*Page.tsx')

/** Whether a page stands there already, which is left only once the next one's code has come. */
let opened = false

const pages = Object.entries(ROUTES).map(([path, name]) => {
  const load = async () => {
    const page = (await code[`./pages/${name}.tsx`]?.())?.[name]
    if (!page) throw new Error(`pages/${name}.tsx has no page of this name.`)
    return page
  }
  const First = lazily(load)
  const Next = lazy(async () => ({ default: await load() }))
  function Opened() {
    const [first] = useState(!opened)
    useEffect(() => {
      opened = true
    }, [])
    return first ? <First meanwhile={<Coming page={name} />} /> : <Next />
  }
  return <Route key={path} path={path} element={<Opened />} />
})

export function App() {
  return (
    <Routes>
      <Route element={<Shell />}>{pages}</Route>
    </Routes>
  )
}
