/** The routes; each page is a bundle of its own, loaded when it is first opened. */
import { createBrowserRouter, type RouteObject } from 'react-router'
import { Shell } from './components/Shell'
import { BrokenPage, NotFoundPage } from './pages/NotFoundPage'

export const routes: RouteObject[] = [
  {
    element: <Shell />,
    errorElement: <BrokenPage />,
    children: [
      {
        // The frame stands, and answers, while the first page's code is on its way.
        hydrateFallbackElement: <div aria-busy="true" />,
        errorElement: <BrokenPage />,
        children: [
          {
            index: true,
            lazy: async () => ({ Component: (await import('./pages/TrainingsPage')).TrainingsPage }),
          },
          {
            path: 'new',
            lazy: async () => ({ Component: (await import('./pages/NewTrainingPage')).NewTrainingPage }),
          },
          {
            path: 'experiments/:experimentId',
            lazy: async () => ({ Component: (await import('./pages/ExperimentPage')).ExperimentPage }),
          },
          {
            path: 'runs/:runId',
            lazy: async () => ({ Component: (await import('./pages/RunPage')).RunPage }),
          },
          {
            path: 'compare',
            lazy: async () => ({ Component: (await import('./pages/ComparePage')).ComparePage }),
          },
          {
            path: 'policies',
            lazy: async () => ({ Component: (await import('./pages/PoliciesPage')).PoliciesPage }),
          },
          {
            path: 'policies/:name',
            lazy: async () => ({ Component: (await import('./pages/PolicyPage')).PolicyPage }),
          },
          {
            path: 'arenas',
            lazy: async () => ({ Component: (await import('./pages/ArenasPage')).ArenasPage }),
          },
          {
            path: 'queue',
            lazy: async () => ({ Component: (await import('./pages/QueuePage')).QueuePage }),
          },
          {
            path: 'evaluations',
            lazy: async () => ({ Component: (await import('./pages/EvaluationsPage')).EvaluationsPage }),
          },
          {
            path: 'evaluations/:evaluationId',
            lazy: async () => ({ Component: (await import('./pages/EvaluationPage')).EvaluationPage }),
          },
          {
            path: 'leaderboards/:suiteHash?',
            lazy: async () => ({ Component: (await import('./pages/LeaderboardPage')).LeaderboardPage }),
          },
          {
            path: 'studies',
            lazy: async () => ({ Component: (await import('./pages/StudiesPage')).StudiesPage }),
          },
          {
            path: 'studies/:studyId',
            lazy: async () => ({ Component: (await import('./pages/StudyPage')).StudyPage }),
          },
          {
            path: 'playground/:playgroundId?',
            lazy: async () => ({ Component: (await import('./pages/PlaygroundPage')).PlaygroundPage }),
          },
          {
            path: 'reproduction',
            lazy: async () => ({ Component: (await import('./pages/ReproductionPage')).ReproductionPage }),
          },
          {
            path: 'join',
            lazy: async () => ({ Component: (await import('./pages/JoinPage')).JoinPage }),
          },
          {
            path: 'account',
            lazy: async () => ({ Component: (await import('./pages/AccountPage')).AccountPage }),
          },
          {
            path: 'projects',
            lazy: async () => ({ Component: (await import('./pages/ProjectsPage')).ProjectsPage }),
          },
          {
            path: 'projects/:projectId',
            lazy: async () => ({ Component: (await import('./pages/ProjectPage')).ProjectPage }),
          },
          {
            path: 'alerts',
            lazy: async () => ({ Component: (await import('./pages/AlertsPage')).AlertsPage }),
          },
          {
            path: 'people',
            lazy: async () => ({ Component: (await import('./pages/PeoplePage')).PeoplePage }),
          },
          {
            path: 'storage',
            lazy: async () => ({ Component: (await import('./pages/StoragePage')).StoragePage }),
          },
          {
            path: 'audit',
            lazy: async () => ({ Component: (await import('./pages/AuditPage')).AuditPage }),
          },
          {
            path: 'reference',
            lazy: async () => ({ Component: (await import('./pages/ApiPage')).ApiPage }),
          },
          { path: '*', element: <NotFoundPage /> },
        ],
      },
    ],
  },
]

export const createRouter = () => createBrowserRouter(routes)
