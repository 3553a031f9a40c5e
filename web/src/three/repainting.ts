/** The table of a transfer asset whose objects have other albedo, computed by the GPU when they are repainted: products of small matrices. */
import type { DataTexture, IUniform, Texture, WebGLRenderer, WebGLRenderTarget } from "three";
import matrixProduct from "../shaders/matrix_product.glsl";
import repaintedTable from "../shaders/repainted_table.glsl";
import { MOST_TERMS, type Surfaces } from "../surface_changes";
import { floatTarget, floatTexture, grayTexture } from "./float_textures";
import { FullscreenPass } from "./fullscreen";

export class Repainting {
  private readonly numbers: DataTexture; // of every surfel
  private readonly own: DataTexture;
  private readonly textures: DataTexture[];
  private readonly one: DataTexture;
  /** feedback + gather `numbers` sent; added + left right, and left right; x gather `numbers`; the table. */
  private readonly feedback: FullscreenPass;
  private readonly added: FullscreenPass;
  private readonly plain: FullscreenPass;
  private readonly reflected: FullscreenPass;
  private readonly sum: FullscreenPass;
  private readonly changed: WebGLRenderTarget;
  /** Drawn in turn. */
  private readonly sums: [WebGLRenderTarget, WebGLRenderTarget];
  private readonly powers: [WebGLRenderTarget, WebGLRenderTarget];
  private readonly before: WebGLRenderTarget;
  private readonly after: WebGLRenderTarget;
  private readonly table: WebGLRenderTarget;
  private hasBefore = false;

  /** `table` and `scale`: of the asset's own table, row after row. */
  constructor(
    private readonly surfaces: Surfaces,
    table: Texture,
    scale: number,
  ) {
    const { transfer, gather, sent, feedback } = surfaces.known;
    const { functions: rank, count } = transfer;
    const transposed = Float32Array.from({ length: sent.length }, (_, i) => sent[(i % rank) * count + Math.floor(i / rank)]);
    const gathered = grayTexture(Float32Array.from(gather), count, rank);
    const back = grayTexture(transposed, rank, count);
    this.one = floatTexture(fours(Float32Array.from({ length: 3 * rank * rank }, (_, i) => (Math.floor(i / 3) % (rank + 1) === 0 ? 1 : 0))), rank, rank);
    this.own = floatTexture(fours(feedback.data), rank, rank);
    this.numbers = floatTexture(new Float32Array(4 * count), count, 1);
    this.textures = [gathered, back, this.one, this.own, this.numbers];
    this.changed = floatTarget(rank, rank);
    this.sums = [floatTarget(rank, rank), floatTarget(rank, rank)];
    this.powers = [floatTarget(rank, rank), floatTarget(rank, rank)];
    this.before = floatTarget(count, rank);
    this.after = floatTarget(count, rank);
    this.table = floatTarget(count, rank);
    const product = (values: Record<string, unknown>, defines: Record<string, number> = {}) => new FullscreenPass(matrixProduct, uniforms({ added: null, numbers: this.numbers, ...values }), defines);
    this.feedback = product({ added: this.own, left: gathered, right: back, count }, { SRBF_BETWEEN: 1 });
    this.added = product({ left: null, right: null, count: rank });
    this.plain = product({ left: null, right: null, count: rank }, { SRBF_PLAIN: 1 });
    this.reflected = product({ left: null, right: gathered, count: rank }, { SRBF_COLUMNS: 1 });
    this.sum = new FullscreenPass(repaintedTable, uniforms({ table, scale, before: this.before.texture, after: this.after.texture }));
  }

  /** The table as it is now, a row of the matrix to a row of texels. */
  draw(renderer: WebGLRenderer, change: Float64Array): Texture {
    const { albedo } = this.surfaces.known;
    if (!this.hasBefore) this.drawReflected(renderer, this.own, albedo, this.before);
    this.hasBefore = true;
    this.setNumbers(change);
    this.feedback.draw(renderer, this.changed);
    this.drawReflected(
      renderer,
      this.changed.texture,
      albedo.map((x, i) => x + change[i]),
      this.after,
    );
    this.sum.draw(renderer, this.table);
    return this.table.texture;
  }

  dispose(): void {
    for (const one of [...this.textures, ...this.sums, ...this.powers, this.changed, this.before, this.after, this.table, this.feedback, this.added, this.plain, this.reflected, this.sum]) one.dispose();
  }

  /** sum over k of feedback^k gather rho. */
  private drawReflected(renderer: WebGLRenderer, feedback: Texture, albedo: Float64Array, target: WebGLRenderTarget): void {
    const terms = this.surfaces.bounces ?? MOST_TERMS;
    const series = this.drawSum(renderer, feedback, terms);
    this.setNumbers(albedo);
    Object.assign(this.reflected.uniforms, uniforms({ left: series, count: terms === 0 ? 0 : this.changed.width }));
    this.reflected.draw(renderer, target);
  }

  /** Powers of `feedback`: of n terms 2n by sum + power sum, or n + 1 by one + feedback sum. Hundreds of terms take few passes. */
  private drawSum(renderer: WebGLRenderer, feedback: Texture, terms: number): Texture {
    let [sum, power]: Texture[] = [this.one, feedback];
    doublings(terms).forEach((doubling, step) => {
      const left = doubling ? power : feedback;
      Object.assign(this.added.uniforms, uniforms({ left, right: sum, added: doubling ? sum : this.one }));
      this.added.draw(renderer, this.sums[step % 2]);
      Object.assign(this.plain.uniforms, uniforms({ left, right: power }));
      this.plain.draw(renderer, this.powers[step % 2]);
      [sum, power] = [this.sums[step % 2].texture, this.powers[step % 2].texture];
    });
    return sum;
  }

  private setNumbers(rgb: Float64Array): void {
    (this.numbers.image.data as Float32Array).set(fours(rgb));
    this.numbers.needsUpdate = true;
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
