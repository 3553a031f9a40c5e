/**
 * Direct light of directional lights on an indirect asset, by one orthographic shadow map each: the passes of `srbf/visibility/shadow_map.py`, with the
 * same shaders. Translucent walls multiply a second map by their transmittance. Other kinds of lights add no direct light.
 */
import {
  AddEquation,
  BufferAttribute,
  BufferGeometry,
  Camera,
  Color,
  CustomBlending,
  DataTexture,
  DstColorFactor,
  FloatType,
  GLSL3,
  HalfFloatType,
  LinearFilter,
  type Material,
  MaxEquation,
  Mesh,
  NearestFilter,
  NoColorSpace,
  type Object3D,
  OneFactor,
  type PixelFormat,
  RawShaderMaterial,
  RedFormat,
  RGBAFormat,
  Scene,
  type Texture,
  type TextureDataType,
  type TextureFilter,
  Vector3,
  Vector4,
  type WebGLRenderer,
  WebGLRenderTarget,
  ZeroFactor,
} from "three";
import directFragment from "../../glsl/stages/direct.frag";
import fullscreenVertex from "../../glsl/stages/fullscreen.vert";
import heightFragment from "../../glsl/stages/shadow_height.frag";
import shadowVertex from "../../glsl/stages/shadow.vert";
import transmittanceFragment from "../../glsl/stages/shadow_transmittance.frag";
import { type Asset, type DirectionalLight, type FloatImage, type Light, moved, SrbfError, type Triple } from "../src";
import { type DirectReceivers, directReceivers } from "./direct_points";
import { fromThree } from "./frames";
import { across, cross, discDirections } from "./sun_disc";

const SIZE = 2048; // texels per side of a shadow map
const NOTHING = -1e30; // height where no occluder is
const KNOTS = 8; // of a transmittance by cosine
/** What direct light needs besides the maps: images of the asset, and the scene that casts shadows. */
export interface DirectInputs {
  normal: FloatImage;
  coverage?: FloatImage;
  /** Of radiance assets. */
  albedo?: FloatImage;
  scene: Object3D;
}

interface Frame {
  across: Triple;
  up: Triple;
  toLight: Triple;
  low: [number, number];
  extent: number;
}

export class DirectLight {
  private readonly receivers: DirectReceivers;
  private readonly corners: { points: DataTexture; normals: DataTexture }[];
  private readonly heights = target(SIZE, SIZE, RedFormat, FloatType);
  private readonly wallHeights = target(SIZE, SIZE, RedFormat, FloatType);
  private readonly transmittances = target(SIZE, SIZE, RGBAFormat, HalfFloatType, LinearFilter);
  private readonly sum: WebGLRenderTarget;
  private readonly occluders = new Scene();
  private readonly walls = new Scene();
  private readonly translucent = new Scene();
  private readonly quad = new Scene();
  private readonly camera = new Camera();
  private readonly frame = { across: { value: [0, 0, 0] }, up: { value: [0, 0, 0] }, toLight: { value: [0, 0, 0] }, low: { value: [0, 0] }, extent: { value: 1 } };
  private readonly lookup: RawShaderMaterial;
  private readonly sunAngle: number;
  private readonly reflectance: DataTexture;
  private drawn = "";

  /** @throws SrbfError where the GPU cannot blend floats. */
  constructor(
    private readonly asset: Asset,
    inputs: DirectInputs,
    private readonly renderer: WebGLRenderer,
  ) {
    if (!renderer.extensions.has("EXT_color_buffer_float") || !renderer.extensions.has("EXT_float_blend")) {
      throw new SrbfError("expected a GPU that blends floats for direct light, found one without: only the indirect light is shown");
    }
    const { width, height, direct } = asset.manifest;
    this.sunAngle = direct?.sun_angle ?? 0;
    this.receivers = directReceivers(asset, asset.position as FloatImage, inputs.normal, inputs.coverage, direct?.footprint ?? 1);
    this.corners = this.receivers.corners.map(({ points, normals }) => ({ points: texture(points, width, height), normals: texture(normals, width, height) }));
    this.reflectance = texture(reflectance(asset, inputs.albedo), width, height);
    this.sum = target(width, height, RGBAFormat, FloatType);
    this.readScene(inputs.scene);
    this.lookup = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: fullscreenVertex,
      fragmentShader: colored(directFragment),
      uniforms: {
        ...this.frame,
        points: { value: null },
        normals: { value: null },
        heights: { value: this.heights.texture },
        wallHeights: { value: this.wallHeights.texture },
        transmittance: { value: this.transmittances.texture },
        reflectance: { value: this.reflectance },
        weight: { value: [0, 0, 0] },
      },
      ...blending("add"),
    });
    const corner = new BufferGeometry();
    corner.setAttribute("corner", new BufferAttribute(new Float32Array([-1, -1, 3, -1, -1, 3]), 2));
    corner.setDrawRange(0, 3);
    this.quad.add(unculled(corner, this.lookup));
  }

  /** The direct light of the directional ones of `lights`, in the asset's quantity, redrawn where they have changed. */
  draw(lights: readonly Light[]): Texture {
    const suns = lights.filter((light): light is DirectionalLight => light.kind === "directional");
    const state = JSON.stringify(suns);
    if (state === this.drawn) return this.sum.texture;
    this.drawn = state;
    const { renderer } = this;
    const kept = { color: renderer.getClearColor(new Color()), alpha: renderer.getClearAlpha(), autoClear: renderer.autoClear };
    renderer.autoClear = false;
    this.clear(this.sum, 0);
    for (const sun of suns) this.add(sun);
    renderer.setRenderTarget(null);
    renderer.setClearColor(kept.color, kept.alpha);
    renderer.autoClear = kept.autoClear;
    return this.sum.texture;
  }

  private add(sun: DirectionalLight): void {
    const towards = moved(sun, this.asset.assetFromWorld).direction;
    const suns = discDirections(towards, this.sunAngle);
    for (const direction of suns) {
      this.setFrame(this.around(direction));
      this.clear(this.heights, NOTHING);
      this.renderer.render(this.occluders, this.camera);
      this.clear(this.wallHeights, NOTHING);
      this.clear(this.transmittances, 1);
      if (this.walls.children.length) {
        this.renderer.setRenderTarget(this.wallHeights);
        this.renderer.render(this.walls, this.camera);
        this.renderer.setRenderTarget(this.transmittances);
        this.renderer.render(this.translucent, this.camera);
      }
      const { uniforms } = this.lookup;
      uniforms.weight.value = sun.color.map((value) => value / (suns.length * this.corners.length));
      this.renderer.setRenderTarget(this.sum);
      for (const { points, normals } of this.corners) {
        uniforms.points.value = points;
        uniforms.normals.value = normals;
        this.renderer.render(this.quad, this.camera);
      }
    }
  }

  private clear(place: WebGLRenderTarget, value: number): void {
    this.renderer.setRenderTarget(place);
    this.renderer.setClearColor(new Color(value, value, value), 1);
    this.renderer.clear(true, false, false);
  }

  private setFrame(frame: Frame): void {
    for (const key of ["across", "up", "toLight", "low", "extent"] as const) this.frame[key].value = frame[key] as never;
  }

  /** A square across the light that holds every point, and a hundredth more on every side. */
  private around(toLight: Triple): Frame {
    const right = across(toLight);
    const up = cross(toLight, right);
    const [least, most] = [[Infinity, Infinity], [-Infinity, -Infinity]];
    const { bounds } = this.receivers;
    for (let i = 0; i < bounds.length; i += 3) {
      const [x, y, z] = [bounds[i], bounds[i + 1], bounds[i + 2]];
      const flat = [x * right[0] + y * right[1] + z * right[2], x * up[0] + y * up[1] + z * up[2]];
      for (const a of [0, 1]) {
        least[a] = Math.min(least[a], flat[a]);
        most[a] = Math.max(most[a], flat[a]);
      }
    }
    const extent = Math.max(most[0] - least[0], most[1] - least[1], 1e-6) * 1.02;
    return { across: right, up, toLight, low: [(least[0] + most[0] - extent) / 2, (least[1] + most[1] - extent) / 2], extent };
  }

  /** Split the triangles that cast shadows into opaque and translucent ones. */
  private readScene(scene: Object3D): void {
    scene.updateMatrixWorld(true);
    const height = new RawShaderMaterial({ glslVersion: GLSL3, vertexShader: shadowVertex, fragmentShader: heightFragment, uniforms: this.frame, ...blending("max") });
    scene.traverse((object) => {
      const mesh = object as Mesh<BufferGeometry, Material>;
      if (!mesh.isMesh || casts(mesh) === false) return;
      const geometry = this.geometry(mesh);
      const curve = transmittanceOf(mesh.material);
      if (!curve) {
        this.occluders.add(unculled(geometry, height));
        return;
      }
      const transmittance = new RawShaderMaterial({
        glslVersion: GLSL3,
        vertexShader: shadowVertex,
        fragmentShader: transmittanceFragment,
        uniforms: { ...this.frame, curve: { value: curve } },
        ...blending("multiply"),
      });
      this.walls.add(unculled(geometry, height));
      this.translucent.add(unculled(geometry, transmittance));
    });
  }

  /** In the asset's frame, z up, about the receivers' center. */
  private geometry(mesh: Mesh): BufferGeometry {
    const { center } = this.receivers;
    const source = mesh.geometry;
    const position = source.getAttribute("position");
    const normal = source.getAttribute("normal");
    const corner = new Float32Array(3 * position.count);
    const cornerNormal = new Float32Array(3 * position.count);
    const normalMatrix = mesh.matrixWorld.clone().invert().transpose();
    const place = new Vector3();
    for (let i = 0; i < position.count; ++i) {
      const p = fromThree(place.fromBufferAttribute(position, i).applyMatrix4(mesh.matrixWorld));
      corner.set([p[0] - center[0], p[1] - center[1], p[2] - center[2]], 3 * i);
      if (normal) cornerNormal.set(fromThree(place.fromBufferAttribute(normal, i).transformDirection(normalMatrix)), 3 * i);
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute("corner", new BufferAttribute(corner, 3));
    geometry.setAttribute("cornerNormal", new BufferAttribute(cornerNormal, 3));
    geometry.setIndex(source.getIndex());
    if (!source.getIndex()) geometry.setDrawRange(0, position.count);
    return geometry;
  }
}

/** The pack's stage with a light's color, and with each texel's response to irradiance. */
function colored(stage: string): string {
  return stage
    .replace("uniform float weight;", "uniform vec3 weight;\nuniform sampler2D reflectance;")
    .replace("visibility) * weight", "visibility) * weight * texelFetch(reflectance, at, 0).rgb");
}

function casts(object: Object3D): boolean {
  for (let at: Object3D | null = object; at; at = at.parent) if (at.userData.casts_shadow === false) return false;
  return true;
}

/** Transmittance of one wall at eight cosines; undefined where it is opaque. */
function transmittanceOf(material: Material): Vector4[] | undefined {
  const curve = material.userData.tint_by_cosine as number[][] | undefined;
  if (curve) return curve.some((row) => row.some((x) => x > 0)) ? curve.map(([r, g, b]) => new Vector4(r, g, b, 0)) : undefined;
  const { transmission = 0, color } = material as Material & { transmission?: number; color?: Color };
  if (!(transmission > 0)) return undefined;
  const { r, g, b } = color ?? new Color(1, 1, 1);
  return Array.from({ length: KNOTS }, () => new Vector4(transmission * r, transmission * g, transmission * b, 0));
}

/** 1, or albedo / pi, RGBA. */
function reflectance(asset: Asset, albedo: FloatImage | undefined): Float32Array {
  const { width, height, quantity } = asset.manifest;
  const out = new Float32Array(4 * width * height).fill(1);
  if (quantity === "irradiance" || !albedo) return out;
  for (let i = 0; i < width * height; ++i) for (let c = 0; c < 3; ++c) out[4 * i + c] = albedo.data[albedo.channels * i + c] / Math.PI;
  return out;
}

function blending(kind: "add" | "max" | "multiply") {
  const factors = kind === "multiply" ? { blendSrc: DstColorFactor, blendDst: ZeroFactor } : { blendSrc: OneFactor, blendDst: OneFactor };
  return { blending: CustomBlending, blendEquation: kind === "max" ? MaxEquation : AddEquation, ...factors, depthTest: false, depthWrite: false, side: 2 } as const;
}

function target(width: number, height: number, format: PixelFormat, type: TextureDataType, filter: TextureFilter = NearestFilter): WebGLRenderTarget {
  return new WebGLRenderTarget(width, height, { format, type, depthBuffer: false, magFilter: filter as never, minFilter: filter as never, colorSpace: NoColorSpace });
}

function texture(data: Float32Array, width: number, height: number): DataTexture {
  const made = new DataTexture(data as never, width, height, RGBAFormat, FloatType);
  made.needsUpdate = true;
  return made;
}

function unculled(geometry: BufferGeometry, material: RawShaderMaterial): Mesh {
  const mesh = new Mesh(geometry, material);
  mesh.frustumCulled = false;
  return mesh;
}
