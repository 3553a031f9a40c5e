/** An asset, a light or a GPU is not as required; the message says what was expected, what was found, and what to do. */
export class SrbfError extends Error {
  override readonly name = "SrbfError";
}
