/** Which surfels a light shines on, as textures of one texel per surfel. */
import { DataTexture, RedFormat, UnsignedByteType } from "three";

const KEPT = 16; // choices

export class LitCells {
  private readonly known = new Map<Uint8Array, DataTexture>();

  constructor(
    private readonly width: number,
    private readonly height: number,
  ) {}

  /** `lit`: of each surfel 1 where the light shines on it, else 0. The red of its texel is that number. */
  of(lit: Uint8Array): DataTexture {
    let found = this.known.get(lit);
    if (!found) {
      if (this.known.size >= KEPT) this.drop(this.known.keys().next().value as Uint8Array);
      const bytes = new Uint8Array(this.width * this.height);
      lit.forEach((one, i) => (bytes[i] = 255 * one));
      found = new DataTexture(bytes, this.width, this.height, RedFormat, UnsignedByteType);
      found.needsUpdate = true;
      this.known.set(lit, found);
    }
    return found;
  }

  dispose(): void {
    for (const lit of [...this.known.keys()]) this.drop(lit);
  }

  private drop(lit: Uint8Array): void {
    this.known.get(lit)?.dispose();
    this.known.delete(lit);
  }
}
