/** The build: static files in `dist`, which the server serves; in development, a proxy to a running server. */
import react from '@vitejs/plugin-react'
import { defineConfig } from 'vite'
import { compressed } from './plugins/compressed'
import { frameFirst } from './plugins/frame'

const server = process.env.MAPLESS_SERVER_URL ?? 'http://127.0.0.1:8400'

export default defineConfig({
  plugins: [react(), frameFirst(), compressed()],
  build: {
    target: 'es2022',
    // The vendors change seldom: a browser keeps them across releases.
    rolldownOptions: {
      output: {
        codeSplitting: {
          groups: [
            { name: 'react', test: /node_modules\/(react|react-dom|react-router|scheduler)\// },
            { name: 'charts', test: /node_modules\/uplot\// },
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
