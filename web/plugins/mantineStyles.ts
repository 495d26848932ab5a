/**
 * Of Mantine's styles only those of the components in use, each with the code that needs it. They are in a layer, so that
 * the pages' own rules win wherever they stand. The theme's variables (`virtual:theme.css`) are worked out here, not by every
 * browser before its first picture.
 */
import { existsSync } from 'node:fs'
import { join } from 'node:path'
import {
  convertCssVariables,
  DEFAULT_THEME,
  deepMerge,
  defaultCssVariablesResolver,
  mergeMantineTheme,
} from '@mantine/core'
import type { Plugin } from 'vite'
import { cssVariables, theme } from '../src/theme'

const CLASSES = /@mantine\/(core|notifications)\/esm\/.*\/(\w+)\.module\.mjs$/
const LAYERED = join(import.meta.dirname, '../node_modules/@mantine/core/styles')

const THEME = 'virtual:theme.css'
const RESOLVED = `\0${THEME}`

type Variables = Record<string, string>

/** What Mantine's own sheet does not say already: repeated for one scheme, a default would win over our own for both. */
const without = (defaults: Variables, all: Variables): Variables =>
  Object.fromEntries(Object.entries(all).filter(([name, value]) => defaults[name] !== value))

/** As `MantineCssVariables` writes them into each page. */
function themeCss(): string {
  const whole = mergeMantineTheme(DEFAULT_THEME, theme)
  const defaults = defaultCssVariablesResolver(DEFAULT_THEME)
  const { variables, light, dark } = deepMerge(defaultCssVariablesResolver(whole), cssVariables(whole))
  return convertCssVariables({
    variables: without(defaults.variables, variables),
    light: without(defaults.light, light),
    dark: without(defaults.dark, dark),
  })
}

export function mantineStyles(): Plugin {
  return {
    name: 'mantine-styles',
    enforce: 'pre',
    resolveId: (id) => (id === THEME ? RESOLVED : null),
    load: (id) => (id === RESOLVED ? themeCss() : null),
    transform: (code, id) => {
      const component = CLASSES.exec(id)?.[2]
      const sheet = `${component}.layer.css`
      if (!component || !existsSync(join(LAYERED, sheet))) return null
      return { code: `import '@mantine/core/styles/${sheet}'\n${code}`, map: null }
    },
  }
}
