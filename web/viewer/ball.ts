/** The white sphere that one moves through the room: lit by probes and, where their light is indirect, by the page's shadow maps. */
import { FloatType, HalfFloatType, LinearFilter, Mesh, type Object3D, RepeatWrapping, RGBAFormat, SphereGeometry, type Texture, Vector3, type WebGLRenderer, WebGLRenderTarget } from "three";
import type { Asset, Light, Triple } from "../src";
import { carried, columnMajor, turned } from "../src/matrix";
import { PROBE_SHADER, SrbfProbes } from "../src/three";
import { FullscreenPass, undisturbed } from "../src/three/fullscreen";
import { floatTexture } from "../src/three/float_textures";
import type { BallState } from "./ball_state";
import { DirectLight } from "./direct_light";
import { byTexels } from "./pixel_light";
import { fromThree, toThree } from "./frames";
import { lineOf, say } from "./messages";
import { screenMaterial, type ScreenUniforms } from "./screen";
import type { State } from "./state";
import { paint } from "./surface_state";

const [WIDTH, HEIGHT] = [96, 48]; // texels of its lightmap
const SIDES = 64;

const LIT = `precision highp float;
precision highp int;
precision highp sampler2D;
${PROBE_SHADER}
uniform sampler2D normals;
uniform sampler2D direct;
uniform mat4 probesFromWorld;
uniform vec3 center;
uniform float radius;
uniform float indirect;
uniform float addDirect;
uniform float scale;
out vec4 lit;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 normal = texelFetch(normals, at, 0).xyz;
    vec3 place = (probesFromWorld * vec4(center + radius * normal, 1.0)).xyz;
    vec3 sum = indirect * srbfProbeLit(place, normalize(mat3(probesFromWorld) * normal));
    if (addDirect > 0.0) sum += texelFetch(direct, at, 0).rgb;
    lit = vec4(scale * sum, 1.0);
}`;

export class Ball {
  /** On the mesh alone. */
  readonly mesh: Mesh;
  readonly geometry = new SphereGeometry(1, SIDES, SIDES / 2);
  private readonly normals = texelNormals();
  private readonly target: WebGLRenderTarget;
  private readonly pass: FullscreenPass;
  private readonly direct?: DirectLight;

  /** `beside`: the lightmap's asset; `scene`: what casts shadows on an indirect one. */
  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly probes: SrbfProbes,
    uniforms: ScreenUniforms,
    private readonly beside: Asset,
    scene: Object3D | undefined,
  ) {
    const floats = renderer.extensions.has("OES_texture_float_linear") && renderer.extensions.has("EXT_color_buffer_float");
    this.target = new WebGLRenderTarget(WIDTH, HEIGHT, { format: RGBAFormat, type: floats ? FloatType : HalfFloatType, magFilter: LinearFilter, minFilter: LinearFilter, wrapS: RepeatWrapping, depthBuffer: false });
    const normals = new Float32Array(4 * WIDTH * HEIGHT);
    this.normals.forEach((normal, i) => normals.set(normal, 4 * i));
    const { manifest, assetFromWorld } = probes.asset;
    const own = {
      normals: { value: floatTexture(normals, WIDTH, HEIGHT) },
      direct: { value: null },
      probesFromWorld: { value: columnMajor(assetFromWorld) },
      center: { value: [0, 0, 0] },
      radius: { value: 1 },
      indirect: { value: 1 },
      addDirect: { value: 0 },
      scale: { value: beside.manifest.quantity === "irradiance" ? 1 : 1 / Math.PI },
    };
    this.pass = new FullscreenPass(LIT, { ...own, ...probes.lookup });
    const uv = this.geometry.getAttribute("uv").clone();
    for (let i = 0; i < uv.count; ++i) uv.setY(i, 1 - uv.getY(i));
    this.geometry.setAttribute("lightmapUv", uv);
    this.mesh = new Mesh(this.geometry, screenMaterial({ ...uniforms, ...byTexels(), relit: { value: this.target.texture } }, "mesh"));
    if (!scene || manifest.transport !== "indirect") return;
    try {
      this.direct = DirectLight.ofPoints(beside, WIDTH, HEIGHT, scene, renderer);
    } catch (error) {
      say(lineOf(error), "hint");
    }
  }

  /** Its light, irradiance or, beside radiance, that of a white surface. */
  get texture(): Texture {
    return this.target.texture;
  }

  /** Draw its light. */
  relight(lights: readonly Light[], surfaces: State["surfaces"], terms: State["terms"], { position, size }: BallState): void {
    const { probes, renderer, pass } = this;
    const { tables, manifest } = probes.asset;
    paint(probes.asset, surfaces);
    const known = tables.names ?? tables.surfaces?.names ?? [];
    probes.lights.splice(0, probes.lights.length, ...lights.filter((light) => light.kind !== "named" || known.includes(light.name)));
    probes.update(renderer);
    const added = terms !== "indirect" && this.direct;
    if (added) {
      const { assetFromWorld } = this.beside;
      const points = this.normals.map((normal) => carried(assetFromWorld, position.map((x, k) => x + size * normal[k]) as unknown as Triple));
      added.move(points, this.normals.map((normal) => turned(assetFromWorld, normal)));
      pass.uniforms.direct.value = added.draw(lights);
    }
    pass.uniforms.addDirect.value = added ? 1 : 0;
    pass.uniforms.indirect.value = terms === "direct" && manifest.transport === "indirect" ? 0 : 1;
    pass.uniforms.center.value = [...position];
    pass.uniforms.radius.value = size;
    undisturbed(renderer, () => pass.draw(renderer, this.target));
  }

  /** Put `mesh` where the state has it. */
  place(mesh: Object3D, { position, size }: BallState): void {
    mesh.position.copy(toThree(position));
    mesh.scale.setScalar(size);
    mesh.updateMatrixWorld(true);
  }
}

/** In the order of the texels, row by row, in the asset's world: as three's spheres have their UVs. */
function texelNormals(): Triple[] {
  return Array.from({ length: WIDTH * HEIGHT }, (_, i) => {
    const [turn, tilt] = [(2 * Math.PI * ((i % WIDTH) + 0.5)) / WIDTH, (Math.PI * (Math.floor(i / WIDTH) + 0.5)) / HEIGHT];
    return fromThree(new Vector3(-Math.cos(turn) * Math.sin(tilt), Math.cos(tilt), Math.sin(turn) * Math.sin(tilt)));
  });
}
