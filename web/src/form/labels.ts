/** What a setting is called, from its path in the configuration. */
import { words } from '../lib/format'
import { branches, resolve, type Schema, withoutNull } from './schema'

/**
 * The title of the setting at `path` with the headings above it, outermost first: "algorithm.network.hidden_sizes" ->
 * ["Algorithm", "Network", "Hidden layers"]. What merely names its object's kind ("algorithm.network.name") is called as
 * the object. A path that the schema does not know is spelled out.
 */
export function labelsOf(schema: Schema, path: readonly string[]): string[] {
  const labels: string[] = []
  let candidates: Schema[] = [resolve(schema, schema)]
  for (const key of path) {
    const found = candidates.flatMap((one) => {
      const property = one.properties?.[key]
      return property ? [withoutNull(resolve(property, schema)).schema] : []
    })
    const [first] = found
    const isKind = key === 'name' && labels.length > 0
    if (!isKind) labels.push(first?.title ?? words(key))
    candidates = found.flatMap((one) => {
      const items = one.items && resolve(one.items, schema)
      // A list's objects go by their kinds: "reward.terms.progress.weight".
      if (items?.discriminator)
        return [
          {
            properties: Object.fromEntries(
              branches(items, schema).map(({ tag, label, schema: branch }) => [
                tag,
                { ...branch, title: label },
              ]),
            ),
          },
        ]
      return one.discriminator ? branches(one, schema).map((branch) => branch.schema) : [one]
    })
  }
  return labels
}
