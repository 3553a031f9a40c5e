/** All reflections between the shapes of a transfer asset whose objects have other albedo, computed by the GPU when they are repainted: products of small matrices. */
import type { DataTexture, IUniform, Texture, WebGLRenderer, WebGLRenderTarget } from "three";
import matrixProduct from "../shaders/matrix_product.glsl";
import { MOST_TERMS, type Surfaces } from "../surface_changes";
import { floatTarget, floatTexture, grayTexture } from "./float_textures";
import { FullscreenPass } from "./fullscreen";

export class Repainting {
  private readonly albedo: DataTexture; // of every surfel: now, and of the bake
  private readonly one: DataTexture;
  private readonly textures: DataTexture[];
  private readonly exchange: FullscreenPass;
  private readonly added: FullscreenPass;
  private readonly plain: FullscreenPass;
  private readonly passes: FullscreenPass[];
  private readonly changed: WebGLRenderTarget; // the exchange
  /** Drawn in turn. */
  private readonly sums: [WebGLRenderTarget, WebGLRenderTarget];
  private readonly powers: [WebGLRenderTarget, WebGLRenderTarget];
  private readonly none: WebGLRenderTarget; // of no bounces
  private readonly targets: WebGLRenderTarget[];
  private readonly terms: number;

  constructor(private readonly surfaces: Surfaces) {
    const { rank, count, gather, sent, feedback } = surfaces.known;
    this.terms = surfaces.bounces ?? MOST_TERMS;
    const [left, right] = [gather, sent].map((matrix) => grayTexture(matrix, count, rank));
    this.albedo = floatTexture(new Float32Array(8 * count), 2, count);
    this.one = floatTexture(fours(Float32Array.from({ length: 3 * rank * rank }, (_, i) => (Math.floor(i / 3) % (rank + 1) === 0 ? 1 : 0))), rank, rank);
    const own = floatTexture(fours(feedback.data), rank, rank);
    this.textures = [left, right, this.albedo, this.one, own];
    const square = () => floatTarget(rank, rank);
    this.changed = square();
    this.sums = [square(), square()];
    this.powers = [square(), square()];
    this.none = square();
    this.targets = [this.changed, ...this.sums, ...this.powers, this.none];
    const product = (values: Record<string, unknown>, defines: Record<string, number>) => new FullscreenPass(matrixProduct, uniforms({ left: null, right: null, added: null, albedo: null, ...values }), defines);
    this.exchange = product({ left, right, albedo: this.albedo, added: own, count }, { SRBF_EXCHANGE: 1 });
    this.added = product({ count: rank }, {});
    this.plain = product({ count: rank }, { SRBF_PLAIN: 1 });
    this.passes = [this.exchange, this.added, this.plain];
  }

  /** The sum of the powers of the exchange with albedo that differs by `change`: a row of the matrix to a row of texels. */
  draw(renderer: WebGLRenderer, change: Float64Array): Texture {
    if (this.terms === 0) return this.none.texture;
    this.setAlbedo(change);
    this.exchange.draw(renderer, this.changed);
    return this.drawSum(renderer, this.changed.texture);
  }

  dispose(): void {
    for (const one of [...this.textures, ...this.targets, ...this.passes]) one.dispose();
  }

  /** Powers of `feedback`: of n terms 2n by sum + power sum, or n + 1 by one + feedback sum. Hundreds of terms take few passes. */
  private drawSum(renderer: WebGLRenderer, feedback: Texture): Texture {
    let [sum, power]: Texture[] = [this.one, feedback];
    doublings(this.terms).forEach((doubling, step) => {
      const left = doubling ? power : feedback;
      Object.assign(this.added.uniforms, uniforms({ left, right: sum, added: doubling ? sum : this.one }));
      this.added.draw(renderer, this.sums[step % 2]);
      Object.assign(this.plain.uniforms, uniforms({ left, right: power }));
      this.plain.draw(renderer, this.powers[step % 2]);
      [sum, power] = [this.sums[step % 2].texture, this.powers[step % 2].texture];
    });
    return sum;
  }

  private setAlbedo(change: Float64Array): void {
    const { albedo } = this.surfaces.known;
    const numbers = this.albedo.image.data as Float32Array;
    for (let i = 0; i < albedo.length; ++i) {
      const at = 8 * Math.floor(i / 3) + (i % 3);
      numbers[at] = albedo[i] + change[i];
      numbers[at + 4] = albedo[i];
    }
    this.albedo.needsUpdate = true;
  }
}

/** How the sum of `terms` powers is made of the first: a step doubles the terms where true, and adds one where false. */
function doublings(terms: number): boolean[] {
  if (terms < 2) return [];
  return [...doublings(Math.floor(terms / 2)), true, ...(terms % 2 ? [false] : [])];
}

function uniforms(values: Record<string, unknown>): Record<string, IUniform> {
  return Object.fromEntries(Object.entries(values).map(([name, value]) => [name, { value }]));
}

function fours(rgb: ArrayLike<number>): Float32Array {
  const out = new Float32Array((4 * rgb.length) / 3);
  for (let i = 0; i < rgb.length; ++i) out[4 * Math.floor(i / 3) + (i % 3)] = rgb[i];
  return out;
}
