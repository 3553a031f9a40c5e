/** Weights of isotropic point lights inside a scene without rays: of nodes of a grid, mixed by what the light sees of them. */
import { SrbfError } from "./errors";
import { decodeFloat } from "./exr";
import type { AssetFiles } from "./files";
import { type TableEntry, tableImage } from "./light_values";
import type { Manifest } from "./manifest";
import type { Triple } from "./matrix";
import type { Fail } from "./methods/method";
import { decodePng } from "./png";

const UNSEEN = 1e-4; // sum of the weights of a cell's corners, below which the light sees none of them

/** Keys of asset.json. */
export interface PositionManifest extends Manifest {
  /** `nodes` along x, y, z from `origin`, `spacing` apart (m); `fine` places per cell and axis have their visibility; `rank` of the factors. */
  position_table?: { origin: Triple; spacing: number; nodes: Triple; fine: number; rank: number };
  position_nodes?: { file: string };
  position_basis?: TableEntry;
  position_visibility?: { file: string };
}

export function checkPositionTable(manifest: PositionManifest, fail: Fail): void {
  const { position_table: table } = manifest;
  if (!table) return;
  const whole = [...(table.nodes ?? []), table.fine, table.rank];
  if (table.nodes?.length !== 3 || whole.some((n) => !(Number.isInteger(n) && n >= 1)) || table.nodes.some((n) => n < 2)) fail("a grid of two nodes or more per axis in position_table", table);
  if (!(table.spacing > 0) || table.origin?.length !== 3) fail("an origin and a spacing in position_table", table);
  for (const key of ["position_nodes", "position_basis", "position_visibility"] as const) if (typeof manifest[key]?.file !== "string") fail(key, manifest[key]);
}

export class PositionTable {
  private constructor(
    private readonly grid: NonNullable<PositionManifest["position_table"]>,
    private readonly functions: number,
    /** (nodes, R), and (R, F, 3). */
    private readonly nodes: Float32Array,
    private readonly basis: Float32Array,
    private readonly visibility: Uint8Array,
  ) {}

  /** @throws SrbfError on files of another size. */
  static async read(files: AssetFiles, manifest: PositionManifest, functions: number): Promise<PositionTable> {
    const grid = manifest.position_table as NonNullable<PositionManifest["position_table"]>;
    const { fine, nodes, rank } = grid;
    const [places, basis, seen] = (["position_nodes", "position_basis", "position_visibility"] as const).map((key) => (manifest[key] as { file: string }).file);
    const [a, b, v] = await Promise.all([
      files.bytes(places).then((buffer) => decodeFloat(buffer, places)),
      tableImage(files, manifest.position_basis as TableEntry, rank, functions),
      files.bytes(seen).then((buffer) => decodePng(buffer, seen)),
    ]);
    const cells = nodes.map((n) => fine * (n - 1));
    const check = (image: { width: number; height: number; channels: number }, width: number, height: number, channels: number, where: string) => {
      if (image.width === width && image.height === height && image.channels >= channels) return;
      throw new SrbfError(`expected ${width} x ${height} x ${channels} numbers in ${where}, found ${image.width} x ${image.height} x ${image.channels}`);
    };
    check(a, rank, nodes[0] * nodes[1] * nodes[2], 1, places);
    check(b, functions, rank, 3, basis);
    check(v, 8 * cells[0], cells[1] * cells[2], 1, seen);
    return new PositionTable(grid, functions, channel(a.data, a.channels, 1), channel(b.data, b.channels, 3), v.channels === 1 ? v.data : v.data.filter((_, i) => i % v.channels === 0));
  }

  /** Weights, (F, 3), of a white light at `position` (m, the asset's frame) of irradiance 1 at 1 m, inverse-square; and whether it sees free space. */
  at(position: Triple): { weights: Float64Array; inside: boolean } {
    const { rank, nodes } = this.grid;
    const { corners, inside } = this.corners(position);
    const mixed = new Float64Array(rank);
    for (const [[i, j, k], weight] of corners) {
      const first = rank * ((k * nodes[1] + j) * nodes[0] + i);
      for (let r = 0; r < rank; ++r) mixed[r] += weight * this.nodes[first + r];
    }
    const weights = new Float64Array(3 * this.functions);
    for (let r = 0, at = 0; r < rank; ++r) for (let f = 0; f < weights.length; ++f, ++at) weights[f] += mixed[r] * this.basis[at];
    return { weights, inside };
  }

  /** The eight nodes about a place, and their weights, of sum 1. */
  private corners(position: Triple): { corners: [Triple, number][]; inside: boolean } {
    const { origin, spacing, nodes } = this.grid;
    const place = position.map((x, a) => Math.min(nodes[a] - 1, Math.max(0, (x - origin[a]) / spacing)));
    const cell = place.map((g, a) => Math.min(Math.floor(g), nodes[a] - 2)) as unknown as Triple;
    const seen = this.seen(place, cell);
    const shares = seen.map((_, c) => offset(c).reduce((share, o, a) => share * (o ? place[a] - cell[a] : 1 - place[a] + cell[a]), 1));
    const visible = shares.map((share, c) => share * seen[c]);
    const sum = visible.reduce((total, weight) => total + weight, 0);
    const inside = sum >= UNSEEN;
    const corners = shares.map((share, c): [Triple, number] => {
      const [x, y, z] = offset(c);
      return [[cell[0] + x, cell[1] + y, cell[2] + z], inside ? visible[c] / sum : share];
    });
    return { corners, inside };
  }

  /** How much a light at `place` sees of each corner of its `cell`: trilinear between the cell's fine places. */
  private seen(place: readonly number[], cell: Triple): number[] {
    const { fine, nodes } = this.grid;
    const steps = place.map((g, a) => Math.min(fine * (cell[a] + 1) - 1, Math.max(fine * cell[a], g * fine - 0.5)));
    const low = steps.map((q, a) => Math.min(Math.floor(q), Math.max(fine * cell[a], fine * (cell[a] + 1) - 2)));
    const width = 8 * fine * (nodes[0] - 1);
    const out = new Array<number>(8).fill(0);
    for (let n = 0; n < 8; ++n) {
      const [x, y, z] = offset(n);
      const share = [x, y, z].reduce((product, o, a) => product * (o ? steps[a] - low[a] : 1 - steps[a] + low[a]), 1);
      if (share === 0) continue;
      const first = ((low[2] + z) * fine * (nodes[1] - 1) + low[1] + y) * width + 8 * (low[0] + x);
      for (let c = 0; c < 8; ++c) out[c] += (share * this.visibility[first + c]) / 255;
    }
    return out;
  }
}

const offset = (corner: number): Triple => [corner & 1, (corner >> 1) & 1, corner >> 2];

function channel(data: Float32Array, channels: number, kept: number): Float32Array {
  if (channels === kept) return data;
  const out = new Float32Array((data.length / channels) * kept);
  for (let i = 0; i < out.length / kept; ++i) for (let c = 0; c < kept; ++c) out[kept * i + c] = data[channels * i + c];
  return out;
}
