/** What lights, which may choose their objects, lay on a pool of surfels, by rays: `srbf/visibility/linked_light.py`. */
import { Occluders } from "./occluders";
import { FAR } from "./received_light";
import type { Placed, Surfels } from "./surfels";

const KEPT = 8; // choices of what casts shadows

export class LinkedLight {
  /** By which triangles cast shadows. */
  private readonly known = new Map<Uint8Array | undefined, Occluders>();

  constructor(private readonly surfels: Surfels) {}

  /** All that casts shadows. */
  get occluders(): Occluders {
    return this.among(undefined);
  }

  /** Irradiance of every surfel under a light in white, (S, 3); 0 on objects that it does not shine on. @throws SrbfError on names that the scene lacks. */
  under(light: Placed): Float64Array {
    const { cells, objects } = this.surfels;
    const links = light.kind === "environment-directions" ? {} : light;
    const [lit, casting] = [objects?.lit(links), objects?.casting(links)];
    const found = cells.under(light, this.among(casting), FAR, cells.count);
    return lit ? found.map((x, i) => x * lit[Math.floor(i / 3)]) : found;
  }

  private among(casting: Uint8Array | undefined): Occluders {
    let found = this.known.get(casting);
    if (!found) {
      const { corners } = this.surfels;
      found = new Occluders(casting ? corners.filter((_, i) => casting[Math.floor(i / 9)]) : corners);
      if (this.known.size > KEPT) this.known.delete([...this.known.keys()].find((key) => key !== undefined));
      this.known.set(casting, found);
    }
    return found;
  }
}
