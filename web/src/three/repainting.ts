/** The table of a transfer asset whose objects have other albedo, computed by the GPU when they are repainted: products of small matrices. */
import type { DataTexture, IUniform, Texture, WebGLRenderer, WebGLRenderTarget } from "three";
import matrixProduct from "../shaders/matrix_product.glsl";
import repaintedTable from "../shaders/repainted_table.glsl";
import type { Surfaces } from "../surface_changes";
import { floatTarget, floatTexture, grayTexture } from "./float_textures";
import { FullscreenPass } from "./fullscreen";

const MOST_TERMS = 64; // of a series without end

export class Repainting {
  private readonly numbers: DataTexture; // of every surfel
  private readonly own: DataTexture;
  private readonly textures: DataTexture[];
  /** feedback + gather `numbers` sent; one + feedback x; x gather `numbers`; the table. */
  private readonly feedback: FullscreenPass;
  private readonly term: FullscreenPass;
  private readonly reflected: FullscreenPass;
  private readonly sum: FullscreenPass;
  private readonly changed: WebGLRenderTarget;
  private readonly terms: [WebGLRenderTarget, WebGLRenderTarget];
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
    const one = floatTexture(fours(Float32Array.from({ length: 3 * rank * rank }, (_, i) => (Math.floor(i / 3) % (rank + 1) === 0 ? 1 : 0))), rank, rank);
    this.own = floatTexture(fours(feedback.data), rank, rank);
    this.numbers = floatTexture(new Float32Array(4 * count), count, 1);
    this.textures = [gathered, back, one, this.own, this.numbers];
    this.changed = floatTarget(rank, rank);
    this.terms = [floatTarget(rank, rank), floatTarget(rank, rank)];
    this.before = floatTarget(count, rank);
    this.after = floatTarget(count, rank);
    this.table = floatTarget(count, rank);
    const product = (values: Record<string, unknown>, defines: Record<string, number> = {}) => new FullscreenPass(matrixProduct, uniforms({ added: null, numbers: this.numbers, ...values }), defines);
    this.feedback = product({ added: this.own, left: gathered, right: back, count }, { SRBF_BETWEEN: 1 });
    this.term = product({ added: one, left: null, right: null, count: 0 });
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
    for (const one of [...this.textures, ...this.terms, this.changed, this.before, this.after, this.table, this.feedback, this.term, this.reflected, this.sum]) one.dispose();
  }

  /** sum over k of feedback^k gather rho: x = one + feedback x again and again, then x gather rho. */
  private drawReflected(renderer: WebGLRenderer, feedback: Texture, albedo: Float64Array, target: WebGLRenderTarget): void {
    const terms = this.surfaces.bounces ?? MOST_TERMS;
    let [last, next] = this.terms;
    for (let k = 0; k < terms; ++k) {
      Object.assign(this.term.uniforms, uniforms({ left: feedback, right: last.texture, count: k === 0 ? 0 : last.width }));
      this.term.draw(renderer, next);
      [last, next] = [next, last];
    }
    this.setNumbers(albedo);
    Object.assign(this.reflected.uniforms, uniforms({ left: last.texture, count: terms === 0 ? 0 : last.width }));
    this.reflected.draw(renderer, target);
  }

  private setNumbers(rgb: Float64Array): void {
    (this.numbers.image.data as Float32Array).set(fours(rgb));
    this.numbers.needsUpdate = true;
  }
}

function uniforms(values: Record<string, unknown>): Record<string, IUniform> {
  return Object.fromEntries(Object.entries(values).map(([name, value]) => [name, { value }]));
}

function fours(rgb: ArrayLike<number>): Float32Array {
  const out = new Float32Array((4 * rgb.length) / 3);
  for (let i = 0; i < rgb.length; ++i) out[4 * Math.floor(i / 3) + (i % 3)] = rgb[i];
  return out;
}
