/** Environment maps that are dropped on the page: EXR, Radiance HDR, PNG; values as `srbf relight --environment` reads them. */
import { FloatType } from "three";
import { HDRLoader } from "three/addons/loaders/HDRLoader.js";
import { SrbfError } from "../src";
import { decodeFloat } from "../src/exr";
import { decodePng } from "../src/png";

export interface Environment {
  width: number;
  height: number;
  /** RGB, row 0 at the top. */
  pixels: Float32Array;
}

/** @throws SrbfError on other kinds of files, and damaged ones. */
export async function readEnvironment(file: File): Promise<Environment> {
  const buffer = await file.arrayBuffer();
  const suffix = file.name.toLowerCase().split(".").pop();
  if (suffix === "exr") return exrEnvironment(buffer, file.name);
  if (suffix === "hdr" || suffix === "pic") return readHdr(buffer, file.name);
  if (suffix === "png") {
    const image = decodePng(buffer, file.name);
    return rgb(image.width, image.height, image.channels, Float32Array.from(image.data, (byte) => byte / 255));
  }
  throw new SrbfError(`expected an environment as .exr, .hdr or .png, found ${file.name}; convert it first`);
}

/** @throws SrbfError on a damaged file. */
export function exrEnvironment(buffer: ArrayBuffer, name: string): Environment {
  const image = decodeFloat(buffer, name);
  return rgb(image.width, image.height, image.channels, image.data);
}

const MANTISSA = 255 / 256; // three divides mantissas by 255, Radiance and OpenImageIO by 256

function readHdr(buffer: ArrayBuffer, name: string): Environment {
  const loader = new HDRLoader();
  loader.type = FloatType;
  let image: { width: number; height: number; data: ArrayLike<number> };
  try {
    image = loader.parse(buffer) as never;
  } catch (error) {
    throw new SrbfError(`cannot read ${name}: ${error instanceof Error ? error.message : String(error)}; is it damaged or cut short?`);
  }
  const { width, height, pixels } = rgb(image.width, image.height, 4, image.data);
  return { width, height, pixels: pixels.map((value) => value * MANTISSA) };
}

function rgb(width: number, height: number, channels: number, data: ArrayLike<number>): Environment {
  const pixels = new Float32Array(3 * width * height);
  const gray = channels < 3;
  for (let i = 0; i < width * height; ++i) for (let c = 0; c < 3; ++c) pixels[3 * i + c] = data[channels * i + (gray ? 0 : c)];
  return { width, height, pixels };
}
