/** Environment maps of a transfer asset, without rays: what each cell of directions that its surfels see adds to the weights of the shapes. */
import { environmentTexels, mapFrame, reduced } from "./environment";
import { SrbfError } from "./errors";
import type { AssetFiles } from "./files";
import { type LightValues, readTable, summed, type TableEntry } from "./light_values";
import type { EnvironmentLight } from "./lights";
import type { Manifest } from "./manifest";
import type { Matrix4, Triple } from "./matrix";

const ROWS = 8; // in which a map is read at least, per side of a cell; twice as many columns

/** Keys of asset.json of an asset whose scene is open. */
export interface EnvironmentManifest extends Manifest {
  environment_transfer?: TableEntry & { rank: number; side: number; cells: number[] };
}

export class EnvironmentTable {
  private readonly known = new WeakMap<object, { map: EnvironmentLight; frame: string; weights: Float64Array }>(); // by a map's pixels: a small one, and its weights

  private constructor(
    private readonly side: number,
    private readonly cells: readonly number[],
    private readonly table: LightValues,
  ) {}

  /** Undefined where the asset has none. @throws SrbfError on a table of another size. */
  static async read(files: AssetFiles, { environment_transfer: told }: EnvironmentManifest): Promise<EnvironmentTable | undefined> {
    if (!told) return undefined;
    const { side, cells, rank } = told;
    if (!(side >= 1) || cells.some((cell) => !(cell >= 0 && cell < side ** 2))) throw new SrbfError(`expected cells below ${side ** 2} in environment_transfer of asset.json, found others; fit the asset again`);
    return new EnvironmentTable(side, cells, await readTable(files, told, rank, cells.length));
  }

  /** Weights of the shapes, (r, 3), under a map; in another color they are not computed again. */
  weights(light: EnvironmentLight, assetFromWorld: Matrix4): Float64Array {
    const frame = String(mapFrame(light, assetFromWorld));
    const found = this.known.get(light.pixels as object);
    const map = found?.map ?? reduced({ ...light, color: [1, 1, 1] }, ROWS * this.side);
    const weights = found?.frame === frame ? found.weights : this.white({ ...map, turn: light.turn }, assetFromWorld);
    this.known.set(light.pixels as object, { map, frame, weights });
    return weights.map((value, i) => value * light.color[i % 3]);
  }

  private white(map: EnvironmentLight, assetFromWorld: Matrix4): Float64Array {
    const radiance = cellRadiance(map, this.side, assetFromWorld);
    return summed(this.table, Float64Array.from({ length: 3 * this.cells.length }, (_, i) => radiance[3 * this.cells[Math.floor(i / 3)] + (i % 3)]));
  }
}

/** The mean radiance of a map in every cell of the octahedral map of directions, row by row, times the light's color, (side^2, 3). */
export function cellRadiance(light: EnvironmentLight, side: number, assetFromWorld: Matrix4): Float64Array {
  const { width, height, pixels, color } = light;
  const [down, across] = [Math.ceil((ROWS * side) / height), Math.ceil((2 * ROWS * side) / width)];
  const flux = new Float64Array(3 * side ** 2);
  const whole = new Float64Array(side ** 2);
  for (const { direction, solidAngle, row, column } of environmentTexels(width * across, height * down, "sphere", mapFrame(light, assetFromWorld))) {
    const cell = cellOf(direction, side);
    const at = 3 * (Math.floor(row / down) * width + Math.floor(column / across));
    whole[cell] += solidAngle;
    for (let c = 0; c < 3; ++c) flux[3 * cell + c] += solidAngle * pixels[at + c] * color[c];
  }
  return flux.map((value, i) => value / Math.max(whole[Math.floor(i / 3)], 1e-30));
}

/** `srbf.visibility.environment_cells.cell_of`: the row is of v, the column of u. */
function cellOf([x, y, z]: Triple, side: number): number {
  const length = Math.abs(x) + Math.abs(y) + Math.abs(z);
  const [a, b] = [x / length, y / length];
  const sign = (value: number) => (value < 0 ? -1 : 1);
  const [u, v] = z < 0 ? [(1 - Math.abs(b)) * sign(a), (1 - Math.abs(a)) * sign(b)] : [a, b];
  const step = (value: number) => Math.min(side - 1, Math.max(0, Math.floor(((value + 1) / 2) * side)));
  return step(v) * side + step(u);
}
