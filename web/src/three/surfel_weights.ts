/**
 * Weights of lights inside a scene, computed by the GPU: direct light on cells of the surfaces by shadow maps, a pass for each point of a light, and the
 * asset's tables as small passes after it. Nothing is read back.
 */
import type { DataTexture, Texture, WebGLRenderer, WebGLRenderTarget } from "three";
import type { Asset } from "../asset";
import { SrbfError } from "../errors";
import type { LightValues } from "../light_values";
import type { Triple } from "../matrix";
import blockSums from "../shaders/block_sums.glsl";
import surfelMeans from "../shaders/surfel_means.glsl";
import tableSums from "../shaders/table_sums.glsl";
import { type ShapeLights, shapeState, shapeWeights } from "../shape_weights";
import { packedCells, packedReflectance, shapesTable, square, type Surfels } from "../surfels";
import type { ShadowedLook } from "./engine_shadows";
import { floatTarget, floatTexture } from "./float_textures";
import { FullscreenPass } from "./fullscreen";
import { Repainting } from "./repainting";
import { SurfelIrradiance } from "./surfel_irradiance";
import { addedNumbers, PART, tableTexture } from "./table_textures";

interface Table {
  parts: FullscreenPass;
  partial: WebGLRenderTarget;
  whole: FullscreenPass;
  target: WebGLRenderTarget;
  texture: DataTexture;
  scale: number;
  added: DataTexture;
}

/** @throws SrbfError on an asset whose lights the GPU cannot follow. */
export function surfelsOf({ tables, manifest }: Asset): Surfels {
  if (tables.surfels) return tables.surfels;
  throw new SrbfError(`expected an asset of lights inside a scene, with cells.exr and scene.glb, for weights "gpu", found ${manifest.method} without; take weights: "cpu"`);
}

export class SurfelWeights {
  readonly middle: Triple;
  private readonly ranges: DataTexture;
  private readonly direct: SurfelIrradiance;
  private readonly received: WebGLRenderTarget;
  private readonly reflectance: DataTexture;
  private readonly means: FullscreenPass;
  private readonly tables: Table[];
  private readonly ranks: number;
  private readonly ofShapes: Table; // whose sums are weights of shapes
  private shapes = "";
  private version = 0;
  private repainting?: Repainting;

  /** `shadowSize`: texels per side of a face of the own shadow maps. @throws SrbfError on an asset without cells. */
  constructor(
    private readonly asset: Asset,
    shadowSize = 512,
  ) {
    const surfels = surfelsOf(asset);
    const { weights } = asset.tables;
    const cells = packedCells(surfels);
    this.middle = cells.middle;
    this.direct = new SurfelIrradiance(surfels, cells, shadowSize);
    this.ranges = floatTexture(cells.ranges, cells.rangesWidth, cells.rangesHeight);
    this.received = floatTarget(cells.rangesWidth, cells.rangesHeight);
    this.reflectance = floatTexture(packedReflectance(surfels.reflectance, cells), cells.rangesWidth, cells.rangesHeight);
    this.means = new FullscreenPass(surfelMeans, { irradiance: { value: null }, normals: { value: this.direct.normals }, ranges: { value: this.ranges }, reflectance: { value: this.reflectance } });
    this.ranks = surfels.tables[shapesTable(surfels)].functions;
    let numbers = this.received.texture;
    this.tables = surfels.tables.map((values, i) => {
      const [width, height] = i === surfels.tables.length - 1 ? [weights.width, weights.height] : square(values.functions);
      const table = tableOf(values, numbers, width, height);
      numbers = table.target.texture;
      return table;
    });
    this.ofShapes = this.tables[shapesTable(surfels)];
  }

  /** The weights, as the shaders of the asset take them. */
  get weights(): Texture {
    return this.tables[this.tables.length - 1].target.texture;
  }

  /** Draw the weights under lights, each a list of looks; within `undisturbed`. */
  draw(renderer: WebGLRenderer, lights: readonly (readonly ShadowedLook[])[]): void {
    this.repaint(renderer);
    this.means.uniforms.irradiance.value = this.direct.draw(renderer, lights.flat()).texture;
    this.means.draw(renderer, this.received);
    for (const { parts, partial, whole, target: wholes } of this.tables) {
      parts.draw(renderer, partial);
      whole.draw(renderer, wholes);
    }
  }

  /** Take the objects that emit, and environments. @throws SrbfError where there are some that the asset does not know. */
  setShapes(lights: ShapeLights): void {
    const { tables } = this.asset;
    const state = `${shapeState(lights)} ${tables.surfaces?.version}`;
    if (state === this.shapes) return;
    this.shapes = state;
    const { added } = this.ofShapes;
    addedNumbers(added, shapeWeights(tables, lights) ?? new Float64Array(3 * this.ranks));
  }

  /** The tables with the albedo that objects have now. */
  private repaint(renderer: WebGLRenderer): void {
    const { surfaces } = this.asset.tables;
    if (!surfaces || surfaces.version === this.version) return;
    this.version = surfaces.version;
    const { parts, texture, scale } = this.ofShapes;
    if (surfaces.change) this.repainting ??= new Repainting(surfaces);
    parts.uniforms.table.value = surfaces.change && this.repainting ? this.repainting.draw(renderer, surfaces.change) : texture;
    parts.uniforms.scale.value = surfaces.change ? 1 : scale;
    const texels = this.reflectance.image.data as Float32Array;
    surfaces.reflectance.forEach((value, i) => (texels[4 * Math.floor(i / 3) + (i % 3)] = value));
    this.reflectance.needsUpdate = true;
  }

  dispose(): void {
    for (const one of [this.direct, this.ranges, this.reflectance, this.received, this.means]) one.dispose();
    for (const { parts, partial, whole, target, texture, added } of this.tables) for (const one of [parts, partial, whole, target, texture, added]) one.dispose();
    this.repainting?.dispose();
  }
}

function tableOf(values: LightValues, numbers: Texture, width: number, height: number): Table {
  const { functions: rows, count, gray } = values;
  const { texture, scale } = tableTexture(values);
  const blocks = Math.ceil(count / PART);
  const partial = floatTarget(...square(rows * blocks));
  const added = floatTexture(new Float32Array(4 * width * height), width, height);
  const parts = new FullscreenPass(
    tableSums,
    { table: { value: texture }, scale: { value: scale }, numbers: { value: numbers }, count: { value: count }, rows: { value: rows }, blocks: { value: blocks }, width: { value: partial.width } },
    gray ? { SRBF_GRAY: 1 } : {},
  );
  const whole = new FullscreenPass(blockSums, { parts: { value: partial.texture }, added: { value: added }, blocks: { value: blocks }, width: { value: width } });
  return { parts, partial, whole, target: floatTarget(width, height), texture, scale, added };
}
