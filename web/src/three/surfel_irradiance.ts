/** Direct light on cells of the surfaces of a scene, by shadow maps: a pass for each point of a light. */
import { type DataTexture, type IUniform, Matrix4, type Texture, type WebGLRenderer, type WebGLRenderTarget } from "three";
import { versine } from "../point_light";
import cellIrradiance from "../shaders/surfel_irradiance.glsl";
import type { Look, PackedCells, Surfels } from "../surfels";
import { type ShadowedLook, shadowUniforms } from "./engine_shadows";
import { floatTarget, floatTexture } from "./float_textures";
import { FullscreenPass } from "./fullscreen";
import { LitCells } from "./lit_cells";
import { OccluderMaps } from "./occluder_maps";
import { ProfileTextures } from "./profile_textures";

const SOFT = 256; // texels per side of a face, where an environment shines from hundreds of directions

/** A pass of surfel_irradiance.glsl. */
export function irradiancePass(uniforms: Record<string, IUniform>, defines: Record<string, number>): FullscreenPass {
  return new FullscreenPass(cellIrradiance, uniforms, defines);
}

export class SurfelIrradiance {
  readonly places: DataTexture;
  readonly normals: DataTexture;
  private readonly lift: number;
  private readonly sums: [WebGLRenderTarget, WebGLRenderTarget];
  readonly maps: OccluderMaps;
  private soft?: OccluderMaps;
  private readonly passes = new Map<string, FullscreenPass>();
  private readonly profiles = new ProfileTextures();
  private readonly lit: LitCells;

  /** `shadowSize`: texels per side of a face of the shadow maps; `defines` of surfel_irradiance.glsl. */
  constructor(
    private readonly surfels: Surfels,
    private readonly cells: PackedCells,
    private readonly shadowSize: number,
    private readonly defines: Record<string, number> = {},
  ) {
    this.lift = surfels.cells.lift;
    this.places = floatTexture(cells.places, cells.width, cells.height);
    this.normals = floatTexture(cells.normals, cells.width, cells.height);
    this.sums = [floatTarget(cells.width, cells.height), floatTarget(cells.width, cells.height)];
    this.maps = new OccluderMaps(surfels.corners, cells.middle, cells.reach, shadowSize);
    this.lit = new LitCells(cells.width, cells.height);
  }

  /** The irradiance of all `looks` together, one texel per cell; within `undisturbed`. */
  draw(renderer: WebGLRenderer, looks: readonly ShadowedLook[]): WebGLRenderTarget {
    let [sum, next] = this.sums;
    renderer.setRenderTarget(sum);
    renderer.setClearColor(0, 0);
    renderer.clear(true, false, false);
    for (const look of looks) {
      this.add(renderer, look, sum.texture, next);
      [sum, next] = [next, sum];
    }
    return sum;
  }

  dispose(): void {
    this.soft?.dispose();
    for (const one of [this.places, this.normals, ...this.sums, this.maps, ...this.passes.values(), this.profiles, this.lit]) one.dispose();
  }

  private add(renderer: WebGLRenderer, look: ShadowedLook, former: Texture, next: WebGLRenderTarget): void {
    const shadow = look.shadow ? shadowUniforms(renderer, look.shadow, this.cells.middle) : undefined;
    const { lit, casting } = this.chosen(look);
    const defines = { ...this.defines, ...(look.distant ? { SRBF_DISTANT: 1 } : {}), ...(look.shape ? { SRBF_PROFILE: 1 } : {}), ...(lit ? { SRBF_CHOSEN: 1 } : {}), SRBF_SHADOW: 1, ...shadow?.defines };
    const key = JSON.stringify(defines);
    let pass = this.passes.get(key);
    if (!pass) {
      pass = irradiancePass(this.uniforms(), defines);
      this.passes.set(key, pass);
    }
    const own = shadow ? {} : this.mapsOf(look).draw(renderer, look.place, look.distant, undefined, casting);
    const values: Record<string, unknown> = {
      former,
      light: look.place,
      color: look.color,
      axis: look.axis,
      a0: look.a0,
      radius: look.radius,
      falloff: look.falloff === "inverse-square" ? 1 : 0,
      versineInner: look.cone ? versine(look.cone[0]) : 3,
      versineOuter: look.cone ? versine(look.cone[1]) : 4,
      lambertian: look.lambertian ? 1 : 0,
      ...(look.shape ? this.profiles.uniforms(look.shape) : {}),
      ...(lit ? { chosen: this.lit.of(lit) } : {}),
      ...own,
      ...shadow?.values,
    };
    for (const [name, value] of Object.entries(values)) pass.uniforms[name].value = value;
    pass.draw(renderer, next);
  }

  private chosen({ links = {} }: Look): { lit?: Uint8Array; casting?: Uint8Array } {
    const { objects } = this.surfels;
    return { lit: objects?.lit(links), casting: objects?.casting(links) };
  }

  private mapsOf({ factor }: Look): OccluderMaps {
    if (!factor || this.shadowSize <= SOFT) return this.maps;
    this.soft ??= new OccluderMaps(this.surfels.corners, this.cells.middle, this.cells.reach, SOFT);
    return this.soft;
  }

  private uniforms(): Record<string, IUniform> {
    const names = ["former", "light", "color", "axis", "a0", "radius", "falloff", "versineInner", "versineOuter", "lambertian", "nearness", "reach", "across", "up", "profile", "profileAcross", "profileUp", "profileTangent", "chosen"];
    const shadows = ["sceneFromCell", "shadowMatrix", "shadowBias", "shadowNormalBias", "shadowIntensity", "shadowDepths", "shadowMap"];
    const uniforms: Record<string, IUniform> = Object.fromEntries([...names, ...shadows].map((name) => [name, { value: null }]));
    return { ...uniforms, places: { value: this.places }, normals: { value: this.normals }, lift: { value: this.lift }, sceneFromCell: { value: new Matrix4() } };
  }
}
