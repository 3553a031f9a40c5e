/** Cells of a pool's surfels, fixed in the scene, each of which receivers see or not as one: `srbf/visibility/near_cells.py`, which says why. */
import { SrbfError } from "./errors";
import type { FloatImage } from "./image";
import type { Triple } from "./matrix";

const WIDE = 1; // width of the cells that count, in distances to the light, or in diameters of what it lights
const BLENDED = 0.5; // of the step from one width to the next, over which both count

export class NearCells {
  private readonly finest: number;

  /** `labels`: rows of levels, the cell of each surfel; `places`: the width of the finest cells, then where each is seen. @throws SrbfError where a cell has no place. */
  constructor(
    private readonly labels: FloatImage,
    private readonly places: FloatImage,
    surfels: number,
    where: string,
  ) {
    const { width, height, channels, data } = labels;
    if (width !== surfels || height < 2) throw new SrbfError(`expected ${surfels} x 2 numbers or more in ${where}, found ${width} x ${height}`);
    const count = places.width - 1;
    for (let i = 0; i < data.length; i += channels) if (!(data[i] >= 0 && data[i] < count)) throw new SrbfError(`expected cells 0 to ${count - 1} in ${where}, found ${data[i]}`);
    this.finest = places.data[0];
  }

  /** Where a cell is seen, m. */
  place(cell: number): Triple {
    const { channels, data } = this.places;
    return [0, 1, 2].map((k) => data[channels * (cell + 1) + k]) as unknown as Triple;
  }

  /**
   * Of each surfel, the cells that it is seen by with the shares of its light. `light`: its place; undefined of a distant one. `places` (n, 3) of the surfels, `flux` of each.
   */
  seen(surfels: readonly number[], places: readonly Triple[], flux: readonly number[], light?: Triple): (readonly [cell: number, share: number])[][] {
    const total = flux.reduce((sum, x) => sum + x, 0);
    const middle = [0, 1, 2].map((k) => places.reduce((sum, place, i) => sum + flux[i] * place[k], 0) / total) as unknown as Triple;
    const spread = Math.sqrt(places.reduce((sum, place, i) => sum + flux[i] * apart(place, middle) ** 2, 0) / total);
    const { width, height, channels, data } = this.labels;
    return surfels.map((surfel, i) => {
      const wide = WIDE * Math.min(2 * spread, light ? apart(places[i], light) : Infinity);
      const level = Math.min(Math.max(Math.log2(Math.max(wide / this.finest, 1e-9)), 0), height - 1);
      const lower = Math.min(Math.floor(level), height - 2);
      const upper = Math.fround(Math.min(Math.max((level - lower - 0.5) / BLENDED + 0.5, 0), 1));
      const cell = (row: number) => data[channels * (row * width + surfel)];
      const both = [[cell(lower), 1 - upper] as const, [cell(lower + 1), upper] as const];
      return both.filter(([, share]) => share > 0);
    });
  }
}

const apart = (a: Triple, b: Triple) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
