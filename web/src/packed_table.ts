/** Tables as bytes of a PNG: each row, or each column of a transposed one, has multiples of one power of two. See `srbf/io/packed_table.py`. */
import { SrbfError } from "./errors";
import type { ByteImage, FloatImage } from "./image";

export type Packed = "rows" | "columns";

const BIAS = 64; // of exponents, in the first column

/** The table of a picture: with as many rows again, or not, of high bytes. @throws SrbfError on a picture of another size. */
export function unpacked({ width, height, channels, data }: ByteImage, rows: number, columns: number, packed: Packed, where: string): FloatImage {
  const [across, down] = packed === "rows" ? [columns, rows] : [rows, columns];
  if (width !== across + 1 || (height !== down && height !== 2 * down)) throw new SrbfError(`expected ${across + 1} x ${down} bytes, or twice the rows, in ${where}, found ${width} x ${height}`);
  const out = new Float32Array(rows * columns * channels);
  const high = height > down ? channels * width * down : -1;
  for (let i = 0; i < down; ++i) {
    const row = channels * width * i;
    const step = 2 ** (data[row] - BIAS);
    for (let j = 0; j < across; ++j) {
      const to = channels * (packed === "rows" ? i * columns + j : j * columns + i);
      for (let c = 0, at = row + channels * (j + 1); c < channels; ++c, ++at) {
        const folded = data[at] + (high < 0 ? 0 : 256 * data[high + at]);
        out[to + c] = step * (folded % 2 ? -(folded + 1) / 2 : folded / 2);
      }
    }
  }
  return { kind: "float", width: columns, height: rows, channels, data: out };
}
