/** What a comparison can take. */

/** Trainings side by side, at most: what the server compares at once. */
export const MAX_COMPARED = 50
