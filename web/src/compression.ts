/** Whether a GPU reads block-compressed layers. */
import type { Asset } from "./asset";
import { SrbfError } from "./errors";

/** @throws SrbfError where the layers are compressed and `reads` of their format is false. */
export function checkCompression(asset: Asset, reads: (encoding: "bc7" | "bc1") => boolean): void {
  const { encoding } = asset.layers;
  if ((encoding === "bc7" || encoding === "bc1") && !reads(encoding)) {
    throw new SrbfError(`expected a GPU that reads ${encoding}, found one that does not; serve it srbf export --target png`);
  }
}
