/** When what has just been drawn can be seen. */

/** Of a tab that is not looked at: such tabs paint nothing. */
const UNSEEN_MS = 100

/** Comes once the browser has shown what the page is now: what nobody waits for is fetched behind that, not beside it. */
export function painted(): Promise<void> {
  return new Promise((come) => {
    const unseen = setTimeout(come, UNSEEN_MS)
    // The first frame draws it, the second one begins when it was shown.
    requestAnimationFrame(() =>
      requestAnimationFrame(() => {
        clearTimeout(unseen)
        come()
      }),
    )
  })
}
