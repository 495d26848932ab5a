/** The routes; each page is a bundle of its own, loaded when it is first opened. */
import { type ComponentType, lazy } from 'react'
import { Route, Routes } from 'react-router'
import { Shell } from './components/Shell'
import { ROUTES } from './routes'

const code = import.meta.glob<Record<string, ComponentType>>('./pages/*Page.tsx')

const pages = Object.entries(ROUTES).map(([path, name]) => {
  const Page = lazy(async () => {
    const page = (await code[`./pages/${name}.tsx`]?.())?.[name]
    if (!page) throw new Error(`pages/${name}.tsx has no page of this name.`)
    return { default: page }
  })
  return <Route key={path} path={path} element={<Page />} />
})

export function App() {
  return (
    <Routes>
      <Route element={<Shell />}>{pages}</Route>
    </Routes>
  )
}
