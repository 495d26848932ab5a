/** The dialog of an episode; its code, and that of its charts, comes when one is looked at. */
import { lazily } from '../../lib/lazily'

export const Replay = lazily(async () => (await import('./ReplayDialog')).ReplayDialog)
