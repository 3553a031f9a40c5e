/** `SurfelWeights` for WebGPURenderer, on WebGPU and on its WebGL2 backend. */
import { Color, type DataTexture, type DepthTexture, FloatType, NearestFilter, RenderTarget, type Texture } from "three";
import * as tsl from "three/tsl";
import type { Renderer } from "three/webgpu";
import type { Asset } from "../../asset";
import { SrbfError } from "../../errors";
import type { LightValues } from "../../light_values";
import type { Triple } from "../../matrix";
import { versine as versineOf } from "../../point_light";
import { type ShapeLights, shapeState, shapeWeights } from "../../shape_weights";
import { packedCells, packedReflectance, shapesTable, square } from "../../surfels";
import type { EngineShadow, ShadowedLook } from "../engine_shadows";
import { floatTexture } from "../float_textures";
import { surfelsOf } from "../surfel_weights";
import { addedNumbers, PART, tableTexture } from "../table_textures";
import { depthsOf, seenInMap, setShadow, shadowUniforms } from "./engine_shadow_nodes";
import { each } from "./inputs";
import type { N } from "./nodes";
import { OccluderNodes } from "./occluder_nodes";
import { disposeOf, type Pass, pass, render } from "./passes";
import { type Stage, TableCompute } from "./table_compute";
import { entryProduct, folded } from "./table_nodes";
import { type CellTextures, irradianceNode, lookUniforms, seenFromFar, seenFromPlace, type Visibility } from "./surfel_irradiance";

const { float, Fn, int, ivec2, min, screenCoordinate, textureLoad, vec3, vec4 } = tsl as Record<string, N>;

interface Shadowed {
  passes: [Pass, Pass];
  uniforms: Record<string, N>;
}

export class SurfelNodes {
  readonly middle: Triple;
  private readonly maps: OccluderNodes;
  private readonly uniforms = lookUniforms();
  private readonly sums: [RenderTarget, RenderTarget];
  /** [from the first of the sums, from the second] of lights at a place, and of distant ones. */
  private readonly looks: { near: [Pass, Pass]; far: [Pass, Pass] };
  /** Those by shadows that three has drawn. */
  private engine = new Map<DepthTexture, Shadowed>();
  private readonly cells: CellTextures;
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
    this.maps = new OccluderNodes(surfels.corners, cells.middle, cells.reach, shadowSize);
    const places = floatTexture(cells.places, cells.width, cells.height);
    const normals = floatTexture(cells.normals, cells.width, cells.height);
    const ranges = floatTexture(cells.ranges, cells.rangesWidth, cells.rangesHeight);
    const reflectance = floatTexture(packedReflectance(surfels.reflectance, cells), cells.rangesWidth, cells.rangesHeight);
    this.textures = [places, normals, ranges, reflectance];
    this.sums = [target(cells.width, cells.height), target(cells.width, cells.height)];
    this.cells = { places, normals, lift: surfels.cells.lift };
    const near = seenFromPlace(this.uniforms, { maps: this.maps.faces.map(({ texture }) => texture), size: shadowSize });
    const far = seenFromFar(this.uniforms, { maps: [this.maps.far.texture], size: 4 * shadowSize });
    this.looks = { near: this.passesOf(false, near), far: this.passesOf(true, far) };
    const received = target(cells.rangesWidth, cells.rangesHeight);
    const mean = (from: 0 | 1) => pass(meanNode(this.sums[from].texture, { normals, ranges, reflectance }, cells.width), received);
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

  draw(renderer: Renderer, looks: readonly ShadowedLook[]): void {
    if (looks.some(({ shape }) => shape)) throw new SrbfError('expected lights without a profile for weights "gpu" of nodes, found one; take weights: "cpu"');
    const kept = { target: renderer.getRenderTarget(), color: renderer.getClearColor(new Color() as never) as unknown as Color, alpha: renderer.getClearAlpha() };
    renderer.setClearColor(new Color(0, 0, 0), 0);
    renderer.setRenderTarget(this.sums[0]);
    renderer.clear();
    let from: 0 | 1 = 0;
    const used = new Map<DepthTexture, Shadowed>();
    for (const look of looks) {
      const shadowed = look.shadow && this.shadowed(renderer, look, look.shadow, used);
      this.set(renderer, look);
      render(renderer, (shadowed?.passes ?? this.looks[look.distant ? "far" : "near"])[from]);
      from = from === 0 ? 1 : 0;
    }
    for (const [depths, { passes }] of this.engine) if (!used.has(depths)) disposeOf(passes);
    this.engine = used;
    render(renderer, this.means[from]);
    for (const one of this.tables) render(renderer, one);
    this.compute?.run(renderer);
    renderer.setRenderTarget(kept.target);
    renderer.setClearColor(kept.color, kept.alpha);
  }

  dispose(): void {
    const passes = [...this.looks.near, ...this.looks.far, ...this.means, ...this.tables];
    disposeOf([...passes, ...[...this.engine.values()].flatMap((one) => one.passes)]);
    for (const { target: drawn } of passes) drawn.dispose();
    for (const one of [...this.textures, ...this.added, this.maps]) one.dispose();
    this.compute?.dispose();
  }

  private passesOf(distant: boolean, visibility: Visibility): [Pass, Pass] {
    const from = (i: 0 | 1) => pass(irradianceNode(this.uniforms, this.cells, this.sums[i].texture, distant, visibility), this.sums[1 - i]);
    return [from(0), from(1)];
  }

  /** The passes of a light by its own shadow, as three has drawn it. */
  private shadowed(renderer: Renderer, { distant }: ShadowedLook, shadow: EngineShadow, used: Map<DepthTexture, Shadowed>): Shadowed {
    const depths = depthsOf(shadow);
    let found = this.engine.get(depths);
    if (!found) {
      const uniforms = shadowUniforms();
      found = { uniforms, passes: this.passesOf(distant, seenInMap(uniforms, shadow, depths, renderer)) };
    }
    setShadow(found.uniforms, shadow, this.middle);
    used.set(depths, found);
    return found;
  }

  private set(renderer: Renderer, look: ShadowedLook): void {
    const axes = look.distant && !look.shadow ? this.maps.drawFar(renderer, look.place) : undefined;
    if (!look.distant && !look.shadow) this.maps.drawNear(renderer, look.place);
    const vectors = { light: look.place, color: look.color, axis: look.axis, ...axes };
    for (const [name, value] of Object.entries(vectors)) this.uniforms[name].value.set(...value);
    const numbers = {
      a0: look.a0,
      radius: look.radius,
      inverseSquare: look.falloff === "inverse-square" ? 1 : 0,
      versineInner: look.cone ? versineOf(look.cone[0]) : 3,
      versineOuter: look.cone ? versineOf(look.cone[1]) : 4,
      lambertian: look.lambertian ? 1 : 0,
      reach: look.distant ? this.maps.reach : 1,
    };
    for (const [name, value] of Object.entries(numbers)) this.uniforms[name].value = value;
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
    const parts = target(...square(values.functions * blocks));
    const whole = target(width, height);
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

function target(width: number, height: number): RenderTarget {
  return new RenderTarget(width, height, { type: FloatType, magFilter: NearestFilter, minFilter: NearestFilter, depthBuffer: false });
}
