/**
 * Which surfels of a pool are bright under a light, by shadow rays to some of them: for passes that have the light of all of them on a GPU.
 * The brightest are asked, and every eighth of the others for the mean; then each that comes out as bright.
 */
import type { Gather } from "./gather";
import type { NearPool, NearSources } from "./near_sources";
import { Occluders } from "./occluders";
import { FAR } from "./received_light";
import type { Placed } from "./surfels";

const STRONGEST = 2048;
const EACH = 8;
const NOTHING = { between: () => false };

export class BrightSurfels {
  private occluders?: Occluders;

  constructor(
    private readonly gather: Gather,
    private readonly pool: NearPool,
  ) {}

  /** The surfels that are far brighter than the mean under this light in white; undefined where none is. */
  under(light: Placed): NearSources | undefined {
    const { albedo, surfels } = this.gather;
    const { cells, corners } = surfels;
    this.occluders ??= new Occluders(corners);
    const irradiance = cells.under(light, NOTHING, FAR, cells.count);
    const reflected = (i: number) => ((albedo[3 * i] * irradiance[3 * i] + albedo[3 * i + 1] * irradiance[3 * i + 1] + albedo[3 * i + 2] * irradiance[3 * i + 2]) / 3) * cells.areas[i];
    const flux = Float64Array.from({ length: cells.count }, (_, i) => reflected(i));
    const order = [...flux.keys()].filter((i) => flux[i] > 0).sort((a, b) => flux[b] - flux[a]);
    const asked = new Uint8Array(cells.count);
    const ask = (chosen: readonly number[]) => {
      const seen = cells.some(chosen).under(light, this.occluders as Occluders, FAR, chosen.length);
      chosen.forEach((i, at) => {
        asked[i] = 1;
        for (let c = 0; c < 3; ++c) irradiance[3 * i + c] = seen[3 * at + c];
      });
    };
    ask(order.filter((_, at) => at < STRONGEST || at % EACH === 0));
    let [sum, seen, all, others] = [0, 0, 0, 0];
    order.forEach((i, at) => {
      if (at < STRONGEST) sum += reflected(i);
      else if (asked[i]) [seen, all] = [seen + reflected(i), all + flux[i]];
      if (at >= STRONGEST) others += flux[i];
    });
    const mean = (sum + (all > 0 ? (others * seen) / all : 0)) / Math.max(this.pool.area, 1e-30);
    const place = "position" in light ? light.position : undefined;
    for (;;) {
      const near = this.pool.sources(irradiance, place, mean);
      const missing = near?.surfels.filter((i) => !asked[i]) ?? [];
      if (!missing.length) return near;
      ask(missing);
    }
  }
}
