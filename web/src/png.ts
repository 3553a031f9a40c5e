/** Linear PNG files of bytes: read by a library and never by the browser, whose decoders may manage colors and multiply by alpha. */
import { decode } from "fast-png";
import { SrbfError } from "./errors";
import type { ByteImage } from "./image";

/** @throws SrbfError on a damaged file, or one that does not hold 8 bits per channel. */
export function decodePng(buffer: ArrayBuffer, where: string): ByteImage {
  let png: ReturnType<typeof decode>;
  try {
    png = decode(new Uint8Array(buffer));
  } catch (error) {
    throw new SrbfError(`cannot read ${where}: ${error instanceof Error ? error.message : String(error)}; is it damaged or cut short?`);
  }
  if (png.depth !== 8 || png.palette) throw new SrbfError(`expected 8 bits per channel in ${where}, found ${png.palette ? "a palette" : png.depth}`);
  return { kind: "uint8", width: png.width, height: png.height, channels: png.channels, data: new Uint8Array(png.data) };
}
