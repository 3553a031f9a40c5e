/** KTX 2.0 files that hold a texture array, not supercompressed; ktx-parse reads the container. */
import { read } from "ktx-parse";
import { SrbfError } from "./errors";
import { type LayerStack, levelBytes, typed } from "./layers";
import type { Encoding } from "./manifest";

const FORMATS: Record<number, Encoding> = { 37: "uint8", 97: "half", 109: "float", 131: "bc1", 145: "bc7" }; // VkFormat

/** The array that a KTX2 file holds. @throws SrbfError on another format or a supercompressed file. */
export function decodeKtx2(buffer: ArrayBuffer, where: string): LayerStack {
  let container: ReturnType<typeof read>;
  try {
    container = read(new Uint8Array(buffer));
  } catch (error) {
    throw new SrbfError(`cannot read ${where}: ${error instanceof Error ? error.message : String(error)}; is it damaged or cut short?`);
  }
  const encoding = FORMATS[container.vkFormat];
  if (encoding === undefined) {
    throw new SrbfError(`expected linear BC7, BC1, RGBA8, RGBA16F or RGBA32F in ${where}, found VkFormat ${container.vkFormat}`);
  }
  if (container.supercompressionScheme !== 0) {
    throw new SrbfError(`expected ${where} without supercompression, found scheme ${container.supercompressionScheme}; let the server compress it`);
  }
  const { pixelWidth: width, pixelHeight: height } = container;
  const count = Math.max(1, container.layerCount);
  const levels = container.levels.map((level, l) => {
    const expected = levelBytes(encoding, width, height, l) * count;
    if (level.levelData.byteLength !== expected) {
      throw new SrbfError(`expected ${expected} bytes of level ${l} in ${where}, found ${level.levelData.byteLength}; export the asset again`);
    }
    return typed(level.levelData, encoding);
  });
  return { width, height, count, encoding, levels };
}
