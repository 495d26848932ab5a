/** What a comparison can take. */

/** Trainings side by side, at most: what the server compares at once. */
export const MAX_COMPARED = 50

/** Trainings of which the server judges every pair. */
export const MOST_IN_PAIRS = 12
