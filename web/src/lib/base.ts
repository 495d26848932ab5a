/** Where the pages begin: at the root of a host, or below the path that the server writes into their HTML. */

/** Before every path that React Router does not write: "" or "/mapless". */
export const BASE = document.documentElement.dataset.base ?? ''

/** A path of the server's as a browser asks for it. */
export const at = (path: string): string => BASE + path
