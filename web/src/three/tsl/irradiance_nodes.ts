/** `SurfelIrradiance` for WebGPURenderer: direct light on cells of the surfaces of a scene, a pass for each point of a light. */
import { type DataTexture, type DepthTexture, type RenderTarget } from "three";
import * as tsl from "three/tsl";
import type { Renderer } from "three/webgpu";
import { versine as versineOf } from "../../point_light";
import type { PackedCells, Surfels } from "../../surfels";
import type { EngineShadow, ShadowedLook } from "../engine_shadows";
import { floatTexture } from "../float_textures";
import { LitCells } from "../lit_cells";
import { ProfileTextures } from "../profile_textures";
import { depthsOf, seenInMap, setShadow, shadowUniforms } from "./engine_shadow_nodes";
import type { N } from "./nodes";
import { OccluderNodes } from "./occluder_nodes";
import { cleared, disposeOf, floatTarget, type Pass, pass, render } from "./passes";
import { irradianceNode, lookUniforms, seenAlong, seenAround, seenFromFar, seenFromPlace, type Visibility } from "./surfel_irradiance";

const { texture } = tsl as Record<string, N>;
const SOFT = 256; // texels per side of a face, where an environment shines from hundreds of directions

/** From the first of the sums, and from the second. */
type Both = [Pass, Pass];
type Kind = "near" | "far" | "profiled";

/** Passes of one way to see lights, made as they are needed. */
interface Passes {
  visible: Record<Kind, Visibility>;
  made: Partial<Record<Kind, Both>>;
}

interface Shadowed extends Passes {
  uniforms: Record<string, N>;
}

interface Maps extends Passes {
  own: OccluderNodes;
}

export class IrradianceNodes {
  readonly places: DataTexture;
  readonly normals: DataTexture;
  /** One of them holds the irradiance, one texel per cell. */
  readonly sums: readonly [RenderTarget, RenderTarget];
  private readonly uniforms = lookUniforms();
  private readonly profiles = new ProfileTextures();
  private readonly unshaped = floatTexture(new Float32Array(4), 1, 1);
  private readonly profile: N = texture(this.unshaped);
  private readonly lit: LitCells;
  private readonly everywhere: Uint8Array;
  /** Of each cell whether the look shines on it. */
  private readonly chosen: N;
  private readonly maps: Maps;
  private soft?: Maps;
  /** Of shadows that three has drawn. */
  private engine = new Map<DepthTexture, Shadowed>();

  /** `shadowSize`: texels per side of a face of the shadow maps; `meanNormals`: normals may be means over several faces. */
  constructor(
    private readonly surfels: Surfels,
    private readonly cells: PackedCells,
    private readonly shadowSize: number,
    private readonly meanNormals = false,
  ) {
    this.places = floatTexture(cells.places, cells.width, cells.height);
    this.normals = floatTexture(cells.normals, cells.width, cells.height);
    this.sums = [floatTarget(cells.width, cells.height), floatTarget(cells.width, cells.height)];
    this.lit = new LitCells(cells.width, cells.height);
    this.everywhere = new Uint8Array(cells.width * cells.height).fill(1);
    this.chosen = texture(this.lit.of(this.everywhere));
    this.maps = this.mapsOf(shadowSize);
  }

  get occluders(): OccluderNodes {
    return this.maps.own;
  }

  /** Which of the sums holds the irradiance of all looks together, from now on. Within `undisturbed`. */
  draw(renderer: Renderer, looks: readonly ShadowedLook[]): 0 | 1 {
    cleared(renderer, this.sums[0]);
    let from: 0 | 1 = 0;
    const used = new Map<DepthTexture, Shadowed>();
    for (const look of looks) {
      const shadowed = look.shadow && this.shadowed(renderer, look.shadow, used);
      const maps = look.factor && this.shadowSize > SOFT ? (this.soft ??= this.mapsOf(SOFT)) : this.maps;
      this.set(renderer, look, maps.own);
      render(renderer, this.passes(shadowed ?? maps, look.distant ? "far" : look.shape ? "profiled" : "near")[from]);
      from = from === 0 ? 1 : 0;
    }
    for (const [depths, { made }] of this.engine) if (!used.has(depths)) disposeOf(Object.values(made).flat());
    this.engine = used;
    return from;
  }

  dispose(): void {
    const maps = [this.maps, ...(this.soft ? [this.soft] : [])];
    for (const { made } of [...maps, ...this.engine.values()]) disposeOf(Object.values(made).flat());
    for (const one of [...maps.map(({ own }) => own), this.profiles, this.unshaped, this.lit, this.places, this.normals, ...this.sums]) one.dispose();
  }

  private mapsOf(size: number): Maps {
    const own = new OccluderNodes(this.surfels.corners, this.cells.middle, this.cells.reach, size);
    const [near, far] = this.meanNormals ? [seenAround, seenAlong] : [seenFromPlace, seenFromFar];
    const atPlace = near(this.uniforms, { maps: own.faces.map(({ texture: face }) => face), size });
    return { own, visible: { near: atPlace, profiled: atPlace, far: far(this.uniforms, { maps: [own.far.texture], size: 4 * size }) }, made: {} };
  }

  private passes({ visible, made }: Passes, kind: Kind): Both {
    const cells = { places: this.places, normals: this.normals, chosen: this.chosen, lift: this.surfels.cells.lift };
    const from = (i: 0 | 1) => pass(irradianceNode(this.uniforms, cells, this.sums[i].texture, kind === "far", visible[kind], kind === "profiled" ? this.profile : undefined), this.sums[1 - i]);
    return (made[kind] ??= [from(0), from(1)]);
  }

  /** The passes of a light by its own shadow, as three has drawn it. */
  private shadowed(renderer: Renderer, shadow: EngineShadow, used: Map<DepthTexture, Shadowed>): Shadowed {
    const depths = depthsOf(shadow);
    let found = this.engine.get(depths);
    if (!found) {
      const uniforms = shadowUniforms();
      const seen = seenInMap(uniforms, shadow, depths, renderer);
      found = { uniforms, visible: { near: seen, far: seen, profiled: seen }, made: {} };
    }
    setShadow(found.uniforms, shadow, this.cells.middle);
    used.set(depths, found);
    return found;
  }

  private set(renderer: Renderer, look: ShadowedLook, maps: OccluderNodes): void {
    const { objects } = this.surfels;
    const { links = {} } = look;
    const casting = objects?.casting(links);
    this.chosen.value = this.lit.of(objects?.lit(links) ?? this.everywhere);
    const axes = look.distant && !look.shadow ? maps.drawFar(renderer, look.place, casting) : undefined;
    if (!look.distant && !look.shadow) maps.drawNear(renderer, look.place, undefined, casting);
    const shape = look.shape && this.profiles.uniforms(look.shape);
    if (shape) this.profile.value = shape.profile;
    const sides = shape ? { profileAcross: shape.profileAcross, profileUp: shape.profileUp } : {};
    const vectors = { light: look.place, color: look.color, axis: look.axis, ...axes, ...sides };
    for (const [name, value] of Object.entries(vectors)) this.uniforms[name].value.set(...value);
    const numbers = {
      a0: look.a0,
      radius: look.radius,
      inverseSquare: look.falloff === "inverse-square" ? 1 : 0,
      versineInner: look.cone ? versineOf(look.cone[0]) : 3,
      versineOuter: look.cone ? versineOf(look.cone[1]) : 4,
      lambertian: look.lambertian ? 1 : 0,
      reach: look.distant ? maps.reach : 1,
      profileTangent: shape?.profileTangent ?? 0,
    };
    for (const [name, value] of Object.entries(numbers)) this.uniforms[name].value = value;
  }
}
