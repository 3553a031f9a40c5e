/** The stored layers of an asset as one array texture's data. */
import { SrbfError } from "./errors";
import type { Encoding } from "./manifest";

/**
 * `count` layers of `width` x `height` texels, four channels each, row 0 at the top. `levels[l]` holds level l of all layers, one after the other:
 * bits of half floats, floats, bytes, or blocks of BC7 (16 bytes) or BC1 (8 bytes) for 4 x 4 texels.
 */
export interface LayerStack {
  readonly width: number;
  readonly height: number;
  readonly count: number;
  readonly encoding: Encoding;
  readonly levels: readonly (Uint16Array | Float32Array | Uint8Array)[];
}

/** Bytes of one layer at `level` of a texture of `width` x `height` texels. */
export function levelBytes(encoding: Encoding, width: number, height: number, level: number): number {
  const w = Math.max(1, width >> level);
  const h = Math.max(1, height >> level);
  if (encoding === "bc7" || encoding === "bc1") return Math.ceil(w / 4) * Math.ceil(h / 4) * (encoding === "bc7" ? 16 : 8);
  return w * h * { half: 8, float: 16, uint8: 4 }[encoding];
}

/** Bytes as the numbers that `encoding` stores. */
export function typed(bytes: Uint8Array, encoding: Encoding): Uint16Array | Float32Array | Uint8Array {
  if (encoding === "half") return new Uint16Array(bytes.slice().buffer);
  if (encoding === "float") return new Float32Array(bytes.slice().buffer);
  return bytes;
}

/** @throws SrbfError where a container's texels differ from the manifest. */
export function checkStack(stack: LayerStack, expected: Omit<LayerStack, "levels">, where: string): LayerStack {
  for (const key of ["width", "height", "count", "encoding"] as const) {
    if (stack[key] !== expected[key]) throw new SrbfError(`expected ${key} ${expected[key]} in ${where}, found ${stack[key]}; export the asset again`);
  }
  return stack;
}

/** Further layers of bytes after those of a stack. @throws SrbfError on a stack of another encoding. */
export function extended(stack: LayerStack, further: readonly Uint8Array[], where: string): LayerStack {
  if (further.length === 0) return stack;
  if (stack.encoding !== "uint8") throw new SrbfError(`expected layers of uint8 in ${where}, found ${stack.encoding}; fit the asset again`);
  const [own] = stack.levels;
  const all = new Uint8Array(own.length + further.reduce((sum, layer) => sum + layer.length, 0));
  all.set(own);
  further.reduce((at, layer) => (all.set(layer, at), at + layer.length), own.length);
  return { ...stack, count: stack.count + further.length, levels: [all] };
}
