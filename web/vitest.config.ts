import { defineConfig, mergeConfig } from 'vitest/config'
import base from './vite.config.ts'

export default mergeConfig(
  base,
  defineConfig({
    test: {
      environment: 'jsdom',
      setupFiles: ['src/testing/setup.ts'],
      // The pages show local times; tests pin the zone so that they read the same everywhere.
      env: { TZ: 'UTC' },
      restoreMocks: true,
      testTimeout: 60_000,
      css: false,
    },
  }),
)
