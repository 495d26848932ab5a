/** The build: static files in `dist`, which the server serves; in development, a proxy to a running server. */
import react from '@vitejs/plugin-react'
import { defineConfig } from 'vite'
import { compressed } from './plugins/compressed'
import { mantineIds } from './plugins/mantineIds'
import { mantineStyles } from './plugins/mantineStyles'
import { pages } from './plugins/pages'

const server = process.env.MAPLESS_SERVER_URL ?? 'http://127.0.0.1:8400'

export default defineConfig({
  plugins: [mantineStyles(), mantineIds(), react(), pages(), compressed()],
  experimental: {
    // Scripts find one another from where they are: the server may stand below a path (src/lib/base.ts).
    renderBuiltUrl: (_, { hostType }) => (hostType === 'js' ? { relative: true } : undefined),
  },
  build: {
    target: 'es2022',
    // One sheet: of what it holds more than a page needs, less is lost than by a turn for each of a dozen.
    cssCodeSplit: false,
    rolldownOptions: {
      output: {
        assetFileNames: ({ names }) =>
          `assets/${names[0]?.split('~')[0]?.replace('.css', '')}-[hash][extname]`,
        // Their names would list every page that shares them.
        chunkFileNames: ({ name }) => `assets/${name.split('~')[0]}-[hash].js`,
        codeSplitting: {
          groups: [
            // The vendors change seldom: a browser keeps them across releases.
            { name: 'react', test: /node_modules\/(react|react-dom|scheduler)\// },
            { name: 'charts', test: /node_modules\/uplot\// },
            { name: 'frame', tags: ['$initial'] },
            // On a slow line a file costs a turn, and more than six wait for one another.
            { name: 'shared', minShareCount: 6 },
          ],
        },
      },
    },
  },
  server: {
    proxy: {
      '/api': { target: server, ws: true },
      '/live': { target: server, ws: true },
      '/replays': { target: server },
    },
  },
})
