/** Which address is which page: for the application, and for the build, which makes each an HTML of its own. */

/** Paths as React Router reads them, and the pages (`pages/NAME.tsx`) that they open. */
export const ROUTES = {
  '/': 'TrainingsPage',
  '/new': 'NewTrainingPage',
  '/experiments/:experimentId': 'ExperimentPage',
  '/runs/:runId': 'RunPage',
  '/compare': 'ComparePage',
  '/policies': 'PoliciesPage',
  '/policies/:name': 'PolicyPage',
  '/arenas': 'ArenasPage',
  '/arenas/draw': 'ArenaEditorPage',
  '/queue': 'QueuePage',
  '/evaluations': 'EvaluationsPage',
  '/evaluations/:evaluationId': 'EvaluationPage',
  '/leaderboards/:suiteHash?': 'LeaderboardPage',
  '/recordings': 'RecordingsPage',
  '/recordings/:recordingId': 'RecordingPage',
  '/studies': 'StudiesPage',
  '/studies/:studyId': 'StudyPage',
  '/playground': 'PlayPage',
  '/playground/:playgroundId': 'PlaygroundPage',
  '/reproduction': 'ReproductionPage',
  '/join': 'JoinPage',
  '/account': 'AccountPage',
  '/projects': 'ProjectsPage',
  '/projects/:projectId': 'ProjectPage',
  '/alerts': 'AlertsPage',
  '/people': 'PeoplePage',
  '/storage': 'StoragePage',
  '/audit': 'AuditPage',
  '/reference': 'ApiPage',
  '*': 'NotFoundPage',
} as const

/**
 * What pages ask the API first, of which their address says all. The HTML comes with it (server/http/pages.py), so that a
 * browser asks while the page's code still comes.
 */
export const FIRST_QUESTIONS: { [page in (typeof ROUTES)[keyof typeof ROUTES]]?: readonly string[] } = {
  ExperimentPage: ['/api/experiments/{experimentId}'],
  RunPage: ['/api/runs/{runId}'],
  PolicyPage: ['/api/policies/{name}'],
  EvaluationPage: ['/api/evaluations/{evaluationId}'],
  StudyPage: ['/api/studies/{studyId}'],
  RecordingPage: ['/api/recordings/{recordingId}'],
}

/** What every page asks before. */
export const EVERYWHERE = ['/api/status', '/api/account'] as const
