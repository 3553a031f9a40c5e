/** OpenEXR files of one (Y), three or four channels, as the library writes them; parse-exr does the work. */
import parseExr from "parse-exr";
import { SrbfError } from "./errors";
import { type FloatImage, flipRows, type HalfImage } from "./image";

const FLOAT = 1015;
const HALF = 1016;
const RED = 1028;

/** An EXR as half floats, values of half files unchanged; RGB comes as RGBA. @throws SrbfError on a damaged file. */
export function decodeHalf(buffer: ArrayBuffer, where: string): HalfImage {
  const { width, height, channels, data } = decoded(buffer, HALF, where);
  return { kind: "half", width, height, channels, data: data as Uint16Array };
}

/** An EXR as single-precision floats. @throws SrbfError on a damaged file. */
export function decodeFloat(buffer: ArrayBuffer, where: string): FloatImage {
  const { width, height, channels, data } = decoded(buffer, FLOAT, where);
  return { kind: "float", width, height, channels, data: data as Float32Array };
}

function decoded(buffer: ArrayBuffer, type: typeof FLOAT | typeof HALF, where: string) {
  let parsed: ReturnType<typeof parseExr>;
  try {
    parsed = parseExr(buffer, type);
  } catch (error) {
    throw new SrbfError(`cannot read ${where}: ${error instanceof Error ? error.message : String(error)}; is it damaged or cut short?`);
  }
  const { width, height, data, format } = parsed;
  flipRows(data, height); // the parser hands rows bottom-up
  return { width, height, channels: format === RED ? 1 : 4, data };
}
