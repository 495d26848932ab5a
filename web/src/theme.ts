/** Colours, type and component defaults: quiet greys, one petrol accent, dense controls. */
import { type CSSVariablesResolver, createTheme, type MantineColorsTuple } from '@mantine/core'
import type { KeyboardEvent } from 'react'

const petrol: MantineColorsTuple = [
  '#eaf6f8',
  '#d3e9ee',
  '#a6d2dc',
  '#76bac9',
  '#50a6b9',
  '#3899af',
  '#2792a9',
  '#177f95',
  '#0b7186',
  '#006276',
]

const dark: MantineColorsTuple = [
  '#d5dade',
  '#b3bac0',
  '#8b949c',
  '#68717a',
  '#4a525a',
  '#353c43',
  '#262c32',
  '#1b2025',
  '#14181c',
  '#0e1114',
]

// From the sixth on dark enough for white on it, and for itself on white.
const red: MantineColorsTuple = [
  '#fff5f5',
  '#ffe3e3',
  '#ffc9c9',
  '#ffa8a8',
  '#ff8787',
  '#ff6b6b',
  '#c92a2a',
  '#c92a2a',
  '#b82525',
  '#a62121',
]

const sans =
  "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, 'Liberation Sans', sans-serif"

export const theme = createTheme({
  primaryColor: 'petrol',
  // White on the dark shade: 4.7 to 1; the shade on dark panels: 3.7 to 1.
  primaryShade: { light: 8, dark: 7 },
  autoContrast: true,
  colors: { petrol, dark, red },
  fontFamily: sans,
  fontFamilyMonospace: "ui-monospace, 'SF Mono', Menlo, Consolas, 'Liberation Mono', monospace",
  fontSizes: { xs: '0.75rem', sm: '0.84375rem', md: '0.9375rem', lg: '1.0625rem', xl: '1.25rem' },
  headings: {
    fontFamily: sans,
    fontWeight: '620',
    sizes: {
      h1: { fontSize: '1.375rem', lineHeight: '1.3' },
      h2: { fontSize: '1rem', lineHeight: '1.4' },
      h3: { fontSize: '0.875rem', lineHeight: '1.4' },
    },
  },
  defaultRadius: 'sm',
  cursorType: 'pointer',
  focusRing: 'auto',
  components: {
    Button: { defaultProps: { size: 'sm' } },
    // What can be chosen is made when it is asked for: a page of closed lists would draw, and measure, every one of them.
    Combobox: { defaultProps: { keepMounted: false } },
    Tooltip: { defaultProps: { openDelay: 300, withArrow: true } },
    Modal: { defaultProps: { centered: true, closeButtonProps: { 'aria-label': 'Close' } } },
    Notification: {
      defaultProps: { closeButtonProps: { 'aria-label': 'Close' } },
      // The library's grey below a title has 3.3 to 1 on white.
      styles: { description: { color: 'var(--mapless-text-quiet)' } },
    },
    // Its focus is on its first item, and on nothing that is no item.
    Menu: {
      defaultProps: {
        position: 'bottom-end',
        shadow: 'md',
        width: 190,
        withInitialFocusPlaceholder: false,
      },
    },
    // Escape closes it by itself; the focus goes back to the button that opened it, not to a dialog that comes after it.
    MenuDropdown: {
      defaultProps: {
        onKeyDown: ({ key, currentTarget }: KeyboardEvent<HTMLElement>) => {
          const opener = currentTarget.getAttribute('aria-labelledby')
          if (key === 'Escape' && opener) document.getElementById(opener)?.focus()
        },
      },
    },
    // What lies over a page belongs to its content, for those who go from landmark to landmark.
    Portal: { defaultProps: { target: '#main' } },
    Table: {
      defaultProps: { verticalSpacing: 7, horizontalSpacing: 'sm', borderColor: 'var(--mapless-line)' },
    },
  },
})

/** Of the frame's own colours (frame.css) those that Mantine has names for. */
export const cssVariables: CSSVariablesResolver = () => ({
  variables: {
    '--mantine-color-body': 'var(--mapless-panel)',
    '--mantine-color-text': 'var(--mapless-text)',
    '--mantine-color-dimmed': 'var(--mapless-text-quiet)',
  },
  light: {},
  dark: {
    '--mantine-color-default-border': '#353c43',
    '--mantine-color-error': 'var(--mantine-color-red-5)',
  },
})
