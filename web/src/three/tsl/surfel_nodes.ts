/** `SurfelWeights` for WebGPURenderer, on WebGPU and on its WebGL2 backend. */
import type { DataTexture, RenderTarget, Texture } from "three";
import * as tsl from "three/tsl";
import type { Renderer } from "three/webgpu";
import type { Asset } from "../../asset";
import type { LightValues } from "../../light_values";
import type { Triple } from "../../matrix";
import { type ShapeLights, shapeState, shapeWeights } from "../../shape_weights";
import { packedCells, packedReflectance, shapesTable, square } from "../../surfels";
import type { ShadowedLook } from "../engine_shadows";
import { floatTexture } from "../float_textures";
import { surfelsOf } from "../surfel_weights";
import { addedNumbers, PART, tableTexture } from "../table_textures";
import { each } from "./inputs";
import { IrradianceNodes } from "./irradiance_nodes";
import type { N } from "./nodes";
import { disposeOf, floatTarget, type Pass, pass, render } from "./passes";
import { type Stage, TableCompute } from "./table_compute";
import { entryProduct, folded } from "./table_nodes";

const { float, Fn, int, ivec2, min, screenCoordinate, textureLoad, vec3, vec4 } = tsl as Record<string, N>;

export class SurfelNodes {
  readonly middle: Triple;
  private readonly direct: IrradianceNodes;
  private readonly means: [Pass, Pass];
  private readonly tables: Pass[];
  private readonly compute?: TableCompute;
  private readonly textures: DataTexture[];
  private readonly added: DataTexture[] = [];
  private readonly ranks: number;
  private readonly ofShapes: number; // the table whose sums are weights of shapes
  private shapes = "";

  /** `computed`: the tables by compute shaders, on WebGPU alone. @throws SrbfError on an asset without cells. */
  constructor(
    private readonly asset: Asset,
    shadowSize = 512,
    computed = false,
  ) {
    const surfels = surfelsOf(asset);
    const cells = packedCells(surfels);
    this.middle = cells.middle;
    this.direct = new IrradianceNodes(surfels, cells, shadowSize);
    const { normals, sums } = this.direct;
    const ranges = floatTexture(cells.ranges, cells.rangesWidth, cells.rangesHeight);
    const reflectance = floatTexture(packedReflectance(surfels.reflectance, cells), cells.rangesWidth, cells.rangesHeight);
    this.textures = [ranges, reflectance];
    const received = floatTarget(cells.rangesWidth, cells.rangesHeight);
    const mean = (from: 0 | 1) => pass(meanNode(sums[from].texture, { normals, ranges, reflectance }, cells.width), received);
    this.means = [mean(0), mean(1)];
    const stages = this.stagesOf(surfels.tables);
    this.ofShapes = shapesTable(surfels);
    this.ranks = surfels.tables[this.ofShapes].functions;
    this.tables = computed ? [] : tablePasses(stages, received);
    if (computed) this.compute = new TableCompute(stages, received);
  }

  /** The weights, as the nodes of the asset take them. */
  get weights(): Texture {
    return this.compute?.weights ?? this.tables[this.tables.length - 1].target.texture;
  }

  /** Take the objects that emit, and environments. @throws SrbfError where there are some that the asset does not know. */
  setShapes(lights: ShapeLights): void {
    const state = shapeState(lights);
    if (state === this.shapes) return;
    this.shapes = state;
    addedNumbers(this.added[this.ofShapes], shapeWeights(this.asset.tables, lights) ?? new Float64Array(3 * this.ranks));
  }

  draw(renderer: Renderer, lights: readonly (readonly ShadowedLook[])[]): void {
    render(renderer, this.means[this.direct.draw(renderer, lights.flat())]);
    for (const one of this.tables) render(renderer, one);
    this.compute?.run(renderer);
  }

  dispose(): void {
    const passes = [...this.means, ...this.tables];
    disposeOf(passes);
    for (const { target: drawn } of passes) drawn.dispose();
    for (const one of [...this.textures, ...this.added, this.direct]) one.dispose();
    this.compute?.dispose();
  }

  private stagesOf(tables: readonly LightValues[]): Stage[] {
    const { weights } = this.asset.tables;
    return tables.map((values, i) => {
      const [width, height] = i === tables.length - 1 ? [weights.width, weights.height] : square(values.functions);
      const { texture, scale } = tableTexture(values);
      const added = floatTexture(new Float32Array(4 * width * height), width, height);
      this.textures.push(texture);
      this.added.push(added);
      return { values, texture, scale, added, width, height };
    });
  }
}

/** Two passes for each table: parts of its rows' sums, and these added up. */
function tablePasses(stages: readonly Stage[], received: RenderTarget): Pass[] {
  let numbers = received;
  return stages.flatMap(({ values, texture, scale, added, width, height }) => {
    const blocks = Math.ceil(values.count / PART);
    const parts = floatTarget(...square(values.functions * blocks));
    const whole = floatTarget(width, height);
    const passes = [pass(partNode(values, texture, scale, numbers, blocks, parts.width), parts), pass(wholeNode(parts, added, blocks, width), whole)];
    numbers = whole;
    return passes;
  });
}

const here = (): N => ivec2(screenCoordinate);

/** `surfel_means.glsl`. */
function meanNode(irradiance: Texture, { normals, ranges, reflectance }: Record<"normals" | "ranges" | "reflectance", Texture>, width: number): N {
  return Fn(() => {
    const range = textureLoad(ranges, here()).toVar();
    const first = int(range.x.add(0.5)).toVar();
    const total = vec3(0).toVar();
    each(int(range.y.add(0.5)), "i", (i) => {
      const at = folded(first.add(i), width).toVar();
      total.addAssign(textureLoad(normals, at).w.mul(textureLoad(irradiance, at).rgb));
    });
    return vec4(total.mul(textureLoad(reflectance, here()).rgb), 1);
  })();
}

/** `table_sums.glsl`. */
function partNode(values: LightValues, table: DataTexture, scale: number, numbers: RenderTarget, blocks: number, width: number): N {
  const { functions, count } = values;
  return Fn(() => {
    const at = here().toVar();
    const index = at.y.mul(width).add(at.x).toVar();
    const row = index.div(blocks).toVar();
    const size = Math.ceil(count / blocks);
    const first = index.mod(blocks).mul(size).toVar();
    const most = tsl.select(row.lessThan(functions), min(int(size), int(count).sub(first)), int(0)) as N;
    const total = vec3(0).toVar();
    each(most.toVar(), "i", (i) => {
      const column = first.add(i).toVar();
      total.addAssign(entryProduct(values, table, numbers, row, column));
    });
    return vec4(total.mul(float(scale)), 1);
  })();
}

/** `block_sums.glsl`. */
function wholeNode(parts: RenderTarget, added: Texture, blocks: number, width: number): N {
  return Fn(() => {
    const at = here().toVar();
    const first = at.y.mul(width).add(at.x).mul(blocks).toVar();
    const total = textureLoad(added, at).rgb.toVar();
    each(blocks, "i", (i) => total.addAssign(textureLoad(parts.texture, folded(first.add(i), parts.width)).rgb));
    return vec4(total, 1);
  })();
}
