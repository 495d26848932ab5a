/**
 * What a page asks of the server first. The HTML names it (plugins/pages), so that it is on its way while the scripts come
 * (public/frame.js), and the client takes the answers up (api/early). Each stands here to the letter as the page asks for it:
 * `{2}` is the second part of the page's path, `{experiments}` the trainings that its query names and nothing else. What has
 * another query is asked for where the page's address has none.
 *
 * Few: they share the line with the scripts.
 */
import type { ROUTES } from './routes'

type PageName = (typeof ROUTES)[keyof typeof ROUTES]

const EVERYWHERE = ['/api/status', '/api/account']

const ASKS: Partial<Record<PageName, readonly string[]>> = {
  TrainingsPage: ['/api/experiments?place=live&query=&sort=-created&limit=100'],
  NewTrainingPage: ['/api/training/form'],
  ExperimentPage: ['/api/experiments/{2}', '/api/compare/metrics?experiment={2}'],
  RunPage: [
    '/api/runs/{2}',
    '/api/runs/{2}/metrics?points=600',
    '/api/runs/{2}/checkpoints?limit=25&offset=0',
  ],
  ComparePage: ['/api/compare/metrics?{experiments}', '/api/compare?{experiments}&margin=0.02'],
  PoliciesPage: ['/api/policies'],
  PolicyPage: ['/api/policies/{2}'],
  ArenasPage: ['/api/arenas'],
  QueuePage: ['/api/queue?limit=50&offset=0', '/api/workers'],
  EvaluationsPage: ['/api/policies', '/api/suites', '/api/evaluations?limit=50&offset=0'],
  StoragePage: ['/api/storage?limit=25&offset=0'],
  ReproductionPage: ['/api/reproduction'],
  PeoplePage: ['/api/people?limit=50&offset=0'],
}

export const asksOf = (page: PageName): string => [...EVERYWHERE, ...(ASKS[page] ?? [])].join(' ')
