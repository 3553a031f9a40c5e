/**
 * Direct light of lights inside the scene by perspective shadow maps: six faces of a cube about a point light, one map of a narrow spot, several
 * of these over a sphere, a spot with a size or an area.
 */
import type { WebGLRenderer, WebGLRenderTarget } from "three";
import directFragment from "../../glsl/stages/direct_point.frag";
import shadowVertex from "../../glsl/stages/point_shadow.vert";
import heightFragment from "../../glsl/stages/point_shadow_nearness.frag";
import transmittanceFragment from "../../glsl/stages/point_shadow_transmittance.frag";
import { type AreaLight, pointLightUniforms, type PunctualLight, type SpotLight, type Triple } from "../src";
import { profileLook } from "../src/point_light";
import { floatTexture } from "../src/three/float_textures";
import { ProfileTextures } from "../src/three/profile_textures";
import { unit } from "../src/lights";
import { cross } from "../src/matrix";
import type { LightChoice } from "./linked_pixels";
import type { Caster } from "./shadow_casters";
import { type LitTexels, ShadowMaps } from "./shadow_maps";
import { across } from "./sun_disc";

const FINE = 2048; // texels per side of a map of a light of one look
const COARSE = 512; // of one of several looks
const GUARD = 3; // texels past a face's edge, for filtering across it
const WIDEST = (60 * Math.PI) / 180; // half-angle of a spot that one map holds
const GRID = 4; // looks per side of an area
const SPHERE_LOOKS = looks(12); // a cube each
const CONE_LOOKS = looks(32); // of a spot with a size, a map each
const NEAREST = 1e-3; // meters: what is nearer casts no shadow
const FACES: readonly (readonly [Triple, Triple, Triple])[] = [0, 1, 2].flatMap((axis) =>
  [1, -1].map((sign) => {
    const along = (k: number, value: number) => [0, 1, 2].map((i) => (i === k ? value : 0)) as unknown as Triple;
    return [along((axis + 1) % 3, 1), along((axis + 2) % 3, 1), along(axis, sign)] as const; // across, up, ahead
  }),
);

export class PointShadows {
  private readonly uniforms = {
    light: { value: [0, 0, 0] as number[] },
    across: { value: [0, 0, 0] as number[] },
    up: { value: [0, 0, 0] as number[] },
    ahead: { value: [0, 0, 0] as number[] },
    reach: { value: 1 },
    nearest: { value: NEAREST },
    face: { value: -1 },
    lambertian: { value: 0 },
    pointLight: { value: {} as object },
    profiled: { value: false },
    profile: { value: floatTexture(new Float32Array(4), 1, 1) },
    profileAcross: { value: [1, 0, 0] as number[] },
    profileUp: { value: [0, 1, 0] as number[] },
    profileTangent: { value: 0 },
    partAcross: { value: [0, 0, 0] as number[] },
    partUp: { value: [0, 0, 0] as number[] },
    sphere: { value: [0, 0, 0, 0] as number[] },
    sphereLook: { value: 0 },
    sphereLooks: { value: SPHERE_LOOKS.length },
  };
  private readonly profiles = new ProfileTextures();
  private readonly fine: ShadowMaps;
  private readonly coarse: ShadowMaps;
  private choice: LightChoice = {};

  /** Lights and casters are relative to `center`, in the asset's frame. */
  constructor(
    renderer: WebGLRenderer,
    lit: readonly LitTexels[],
    casters: readonly Caster[],
    private readonly center: Triple,
  ) {
    const stages = { vertex: shadowVertex, height: heightFragment, transmittance: transmittanceFragment, direct: directFragment };
    const maps = (size: number) => new ShadowMaps(renderer, lit, casters, stages, this.uniforms, size, 0);
    this.fine = maps(FINE);
    this.coarse = maps(COARSE);
  }

  /** Add the light of `light`, in the asset's frame, to `sum`. */
  add(sum: WebGLRenderTarget, light: PunctualLight | AreaLight, choice: LightChoice): void {
    const { uniforms } = this;
    this.choice = choice;
    const shape = light.kind === "area" ? undefined : profileLook(light);
    uniforms.profiled.value = shape !== undefined;
    if (shape) for (const [name, value] of Object.entries(this.profiles.uniforms(shape))) uniforms[name as "profile"].value = value as never;
    uniforms.partAcross.value = uniforms.partUp.value = [0, 0, 0];
    uniforms.sphere.value = [0, 0, 0, 0];
    if (light.kind === "area") {
      const { position, u, v, a0, color } = light;
      const direction = unit(cross(u, v));
      const base = { kind: "spot", direction, inner: Math.PI / 2, outer: Math.PI / 2, falloff: "inverse-square", radius: NEAREST, a0 } as const;
      const steps = Array.from({ length: GRID }, (_, i) => (i + 0.5) / GRID - 0.5);
      const places = steps.flatMap((s) => steps.map((t) => [0, 1, 2].map((k) => position[k] + s * u[k] + t * v[k]) as unknown as Triple));
      [uniforms.partAcross.value, uniforms.partUp.value] = [u, v].map((side) => side.map((x) => x / GRID));
      for (const place of places) this.cube(sum, { ...base, position: place, color: shared(color, places.length) }, COARSE, 1);
    } else if ("size" in light && light.size) {
      const { position: middle, size } = light;
      const places = (isNarrow(light) ? CONE_LOOKS : SPHERE_LOOKS).map((look) => look.map((x, k) => middle[k] + size * x) as unknown as Triple);
      uniforms.sphereLooks.value = places.length;
      uniforms.sphere.value = [...light.position.map((x, k) => x - this.center[k]), light.size];
      places.forEach((position, i) => {
        uniforms.sphereLook.value = i;
        const color = shared(light.color, places.length);
        this.shine(sum, { ...light, position, color }, COARSE);
      });
    } else this.shine(sum, light, FINE);
  }

  /** One place: by one map of a narrow cone, by a cube otherwise. */
  private shine(sum: WebGLRenderTarget, light: PunctualLight, size: number): void {
    if (isNarrow(light)) this.cone(sum, light, size);
    else this.cube(sum, light, size);
  }

  private cube(sum: WebGLRenderTarget, light: PunctualLight, size: number, lambertian = 0): void {
    FACES.forEach((axes, face) => {
      this.look(light, axes, size / (size - 2 * GUARD), face, lambertian);
      (size === FINE ? this.fine : this.coarse).add(sum, light.color, this.choice);
    });
  }

  private cone(sum: WebGLRenderTarget, light: SpotLight, size: number): void {
    const right = across(light.direction);
    this.look(light, [right, cross(light.direction, right), light.direction], (Math.tan(light.outer) * size) / (size - 2 * GUARD), -1, 0);
    (size === FINE ? this.fine : this.coarse).add(sum, light.color, this.choice);
  }

  private look(light: PunctualLight, [right, up, ahead]: readonly [Triple, Triple, Triple], reach: number, face: number, lambertian: number): void {
    const { uniforms, center } = this;
    const position = light.position.map((x, k) => x - center[k]) as unknown as Triple;
    const members = pointLightUniforms({ ...light, position, color: [1, 1, 1] });
    if (lambertian) Object.assign(members, { versineInner: 3, versineOuter: 4 }); // the cosine is its cone
    uniforms.pointLight.value = members;
    uniforms.light.value = [...position];
    uniforms.across.value = [...right];
    uniforms.up.value = [...up];
    uniforms.ahead.value = [...ahead];
    uniforms.reach.value = reach;
    uniforms.face.value = face;
    uniforms.lambertian.value = lambertian;
  }
}

const shared = (color: Triple, count: number) => color.map((x) => x / count) as unknown as Triple;

const isNarrow = (light: PunctualLight): light is SpotLight => light.kind === "spot" && light.outer <= WIDEST;

/** Places in a unit sphere that fill its disc evenly from wherever it is seen. */
function looks(count: number): Triple[] {
  const golden = (Math.sqrt(5) - 1) / 2;
  return Array.from({ length: count }, (_, i) => {
    const away = depth((0.5 + i * golden) % 1);
    const height = 1 - (2 * i + 1) / count;
    const turn = i * Math.PI * (3 - Math.sqrt(5));
    const flat = Math.sqrt(1 - height * height);
    return [away * flat * Math.cos(turn), away * flat * Math.sin(turn), away * height];
  });
}

/** The distance from the middle of a unit sphere within which `share` of a density of 1 / sqrt(1 - r^2) lies: its projection is even. */
function depth(share: number): number {
  let [low, high] = [0, Math.PI / 2];
  for (let i = 0; i < 30; ++i) {
    const angle = (low + high) / 2;
    if (angle - Math.sin(angle) * Math.cos(angle) < (share * Math.PI) / 2) low = angle;
    else high = angle;
  }
  return Math.sin(low);
}
