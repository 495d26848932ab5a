/** Line colours that people with any colour vision tell apart (after Okabe and Ito, 2008), for both schemes. */
const LIGHT = ['#0072b2', '#d55e00', '#00895e', '#b8568f', '#a06f00', '#3f9bd1', '#6a4fb3', '#4d4d4d']
const DARK = ['#56a9e8', '#ff8b4d', '#2fc796', '#e39ac6', '#e8b23a', '#9ad2f5', '#a893f0', '#c4c4c4']

/** The colour of the `index`-th line; after eight they repeat. */
export function lineColor(index: number, dark: boolean): string {
  const colors = dark ? DARK : LIGHT
  return colors[index % colors.length] ?? '#888888'
}
