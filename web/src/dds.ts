/** DDS files with the DX10 header that hold a texture array. */
import { SrbfError } from "./errors";
import { type LayerStack, levelBytes, typed } from "./layers";
import type { Encoding } from "./manifest";

const MAGIC = 0x20534444; // "DDS "
const DX10 = 0x30315844; // "DX10"
const HEADER = 148; // magic, DDS_HEADER, DDS_HEADER_DXT10
const FORMATS: Record<number, Encoding> = { 2: "float", 10: "half", 28: "uint8", 71: "bc1", 98: "bc7" }; // DXGI_FORMAT

/** The array that a DDS file holds, layer after layer with its mip levels. @throws SrbfError on another kind of DDS, or one cut short. */
export function decodeDds(buffer: ArrayBuffer, where: string): LayerStack {
  const view = new DataView(buffer);
  if (buffer.byteLength < HEADER || view.getUint32(0, true) !== MAGIC || view.getUint32(84, true) !== DX10) {
    throw new SrbfError(`expected a DDS file with the DX10 header at ${where}, found another file; srbf export --target dds writes them`);
  }
  const height = view.getUint32(12, true);
  const width = view.getUint32(16, true);
  const count = Math.max(1, view.getUint32(140, true));
  const levelCount = Math.max(1, view.getUint32(28, true));
  const encoding = FORMATS[view.getUint32(128, true)];
  if (encoding === undefined) {
    throw new SrbfError(`expected linear BC7, BC1, RGBA8, RGBA16F or RGBA32F in ${where}, found DXGI format ${view.getUint32(128, true)}`);
  }
  const sizes = Array.from({ length: levelCount }, (_, level) => levelBytes(encoding, width, height, level));
  const layerBytes = sizes.reduce((sum, size) => sum + size, 0);
  if (buffer.byteLength < HEADER + count * layerBytes) {
    throw new SrbfError(`expected ${HEADER + count * layerBytes} bytes in ${where}, found ${buffer.byteLength}: it is cut short`);
  }
  let start = HEADER;
  const levels = sizes.map((size) => {
    const level = new Uint8Array(size * count);
    for (let layer = 0; layer < count; ++layer) level.set(new Uint8Array(buffer, start + layer * layerBytes, size), layer * size);
    start += size;
    return typed(level, encoding);
  });
  return { width, height, count, encoding, levels };
}
