/** What an asset, a light or a GPU was not as it must be; the message says what was expected, what was found, and what to do. */
export class SrbfError extends Error {
  override readonly name = "SrbfError";
}
