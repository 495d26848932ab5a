// A provider of identities, by the certified `oidc-provider` of web/node_modules: anybody signs in by name, with any password.
//
// node oidc_provider.mjs WEB PORT PEOPLE CLIENT...
//   WEB     folder with node_modules
//   PEOPLE  JSON file, read anew at every sign-in: claims by name
//   CLIENT  JSON, as the provider's configuration has it
import { readFileSync } from 'node:fs'
import { createRequire } from 'node:module'
import { join } from 'node:path'
import { pathToFileURL } from 'node:url'

const [web, port, people, ...clients] = process.argv.slice(2)
const found = createRequire(join(web, 'package.json')).resolve('oidc-provider')
const { default: Provider } = await import(pathToFileURL(found))

const provider = new Provider(`http://127.0.0.1:${port}`, {
  clients: clients.map((client) => JSON.parse(client)),
  claims: {
    openid: ['sub'],
    profile: ['preferred_username'],
    email: ['email', 'email_verified'],
    groups: ['groups'],
  },
  pkce: { required: () => true },
  cookies: { keys: ['of a test'] },
  findAccount: (_context, name) => ({
    accountId: name,
    claims: () => ({ sub: name, ...JSON.parse(readFileSync(people, 'utf8'))[name] }),
  }),
})
provider.listen(Number(port), '127.0.0.1', () => console.log('listening'))
