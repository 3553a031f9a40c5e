/** Triangles that cast shadows as a geometry: all of them, or those that a light chooses. */
import { BufferAttribute, BufferGeometry } from "three";
import type { Triple } from "../matrix";

const KEPT = 16; // choices

export class OccluderGeometry {
  private readonly all = new BufferGeometry();
  private readonly chosen = new Map<Uint8Array, BufferGeometry>();

  /** `corners` less `middle`. */
  constructor(corners: Float32Array, middle: Triple) {
    this.all.setAttribute("position", new BufferAttribute(corners.map((x, i) => x - middle[i % 3]), 3));
  }

  /** `casting`: of each triangle 1 where it casts a shadow, else 0; all do without. */
  of(casting?: Uint8Array): BufferGeometry {
    if (!casting) return this.all;
    let found = this.chosen.get(casting);
    if (!found) {
      if (this.chosen.size >= KEPT) this.drop(this.chosen.keys().next().value as Uint8Array);
      const corners = [...casting.keys()].flatMap((i) => (casting[i] ? [3 * i, 3 * i + 1, 3 * i + 2] : []));
      found = new BufferGeometry().setAttribute("position", this.all.getAttribute("position"));
      found.setIndex(new BufferAttribute(new Uint32Array(corners.length ? corners : [0, 0, 0]), 1)); // one without area stands for none
      this.chosen.set(casting, found);
    }
    return found;
  }

  dispose(): void {
    for (const casting of [...this.chosen.keys()]) this.drop(casting);
    this.all.dispose();
  }

  private drop(casting: Uint8Array): void {
    this.chosen.get(casting)?.dispose();
    this.chosen.delete(casting);
  }
}
