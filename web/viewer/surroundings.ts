/**
 * The lit mesh in its scene, in linear light: the relit lightmap on the receivers, three.js's own materials and shadows on the rest of the file, and
 * glass last, refracting what is behind it [Wong2005, fig. 12].
 */
import {
  BackSide,
  Box3,
  type BufferGeometry,
  Color,
  DataTexture,
  DirectionalLight,
  EquirectangularReflectionMapping,
  FloatType,
  FrontSide,
  GLSL3,
  HalfFloatType,
  type IUniform,
  LinearFilter,
  type Material,
  Mesh,
  type MeshPhysicalMaterial,
  type MeshStandardMaterial,
  type Object3D,
  type PerspectiveCamera,
  PMREMGenerator,
  PointLight,
  RawShaderMaterial,
  RGBAFormat,
  Scene,
  ShaderMaterial,
  type Side,
  Sphere,
  SphereGeometry,
  SpotLight,
  type Texture,
  Vector3,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import type { EnvironmentLight, PunctualLight, Light } from "../src";
import { toThree } from "./frames";
import { PIXEL_LIGHT } from "./pixel_light";
import type { ScreenUniforms } from "./screen";

const SHADOW_SIZE = 2048;
const SHADOWED_POINT_LIGHTS = 2; // point lights that cast shadows on the rest of the scene; each draws it six times
const FILL = 0.12; // of the lights' irradiance: dim daylight on what the lightmap does not light, and for glass to reflect
const SAMPLES = 4;

export class Surroundings {
  private readonly scene = new Scene();
  private readonly lit: Object3D[] = [];
  private readonly sides = new Map<Material, Side>();
  private readonly target: WebGLRenderTarget;
  private readonly bounds: Sphere;
  private readonly daylight: Texture;
  private readonly environments = new WeakMap<object, Texture>();
  private readonly pmrem: PMREMGenerator;
  private drawn = "";
  private drawnEnvironment: object | undefined;

  /** `model` is the glTF's scene, in three's world; the receivers' materials show what `uniforms` hold. */
  constructor(
    model: Object3D,
    uniforms: ScreenUniforms,
    light: ReceivedLight,
    private readonly renderer: WebGLRenderer,
  ) {
    this.scene.add(model);
    model.updateMatrixWorld(true);
    this.bounds = new Box3().setFromObject(model).getBoundingSphere(new Sphere());
    model.traverse((object) => {
      const mesh = object as Mesh<BufferGeometry, Material>;
      if (!mesh.isMesh) return;
      if (mesh.geometry.getAttribute("lightmapUv")) {
        mesh.material = receiverMaterial(mesh, uniforms, light);
        mesh.castShadow = true;
      } else if (isGlass(mesh.material)) mesh.receiveShadow = true;
      else mesh.castShadow = mesh.receiveShadow = true;
      if (!isGlass(mesh.material)) {
        mesh.material.shadowSide ??= mesh.material.side; // what is cut casts shadows all the same
        this.sides.set(mesh.material, mesh.material.side);
      }
    });
    this.target = new WebGLRenderTarget(1, 1, { type: HalfFloatType, samples: SAMPLES, minFilter: LinearFilter, magFilter: LinearFilter });
    renderer.shadowMap.autoUpdate = false; // a moving camera changes no shadows
    this.pmrem = new PMREMGenerator(renderer);
    this.daylight = this.pmrem.fromScene(daylight(), 0.02).texture;
  }

  /** A mesh with `lightmapUv` of white surface, whose light `uniforms` hold; it casts shadows. */
  add(mesh: Mesh, uniforms: ScreenUniforms, quantity: "irradiance" | "radiance"): void {
    mesh.material = receiverMaterial(mesh, uniforms, { quantity });
    mesh.castShadow = true;
    this.scene.add(mesh);
  }

  /** Draw the shadows again: something has moved. */
  moved(): void {
    this.drawn = "";
  }

  /** Whether a file holds meshes besides the receivers. */
  static in(model: Object3D): boolean {
    const [receivers, others] = [0, 0].map(() => [] as Object3D[]);
    model.traverse((object) => {
      const mesh = object as Mesh<BufferGeometry, Material>;
      if (mesh.isMesh) (mesh.material.userData.gltfExtensions?.SRBF_relighting_map ? receivers : others).push(mesh);
    });
    return receivers.length > 0 && others.length > 0;
  }

  /** Hide what is seen from behind, or show it as the file has it. */
  cut(on: boolean): void {
    for (const [material, side] of this.sides) material.side = on ? FrontSide : side;
  }

  /** Linear radiance over `background`, `width` x `height` pixels, row 0 at the bottom. */
  draw(camera: PerspectiveCamera, lights: readonly Light[], background: Color, width: number, height: number): Texture {
    const { renderer } = this;
    this.target.setSize(width, height);
    this.setLights(lights);
    const kept = { enabled: renderer.shadowMap.enabled, color: renderer.getClearColor(new Color()), alpha: renderer.getClearAlpha() };
    renderer.shadowMap.enabled = true;
    renderer.setClearColor(background, 1);
    renderer.setRenderTarget(this.target);
    renderer.autoClear = true;
    renderer.render(this.scene, camera);
    renderer.setRenderTarget(null);
    renderer.shadowMap.enabled = kept.enabled;
    renderer.setClearColor(kept.color, kept.alpha);
    return this.target.texture;
  }

  private setLights(lights: readonly Light[]): void {
    const state = JSON.stringify(lights, (key, value) => (key === "pixels" ? value.length : value));
    const shown = lights.find((light) => light.kind === "environment")?.pixels;
    if (state === this.drawn && shown === this.drawnEnvironment) return;
    this.drawn = state;
    this.drawnEnvironment = shown;
    for (const light of this.lit) {
      this.scene.remove(light);
      (light as DirectionalLight).dispose?.();
    }
    this.lit.length = 0;
    let pointLights = 0;
    let fill = 0;
    let environment: EnvironmentLight | undefined;
    for (const light of lights) {
      if (light.kind === "environment") {
        environment ??= light;
        continue;
      }
      if (light.kind === "named") {
        fill = Math.max(fill, ...light.color); // where it is in the scene is not known: only its light on the receivers is
        continue;
      }
      if (light.kind === "area") {
        fill += 0.3 * Math.max(...light.color); // three.js has no shadows of areas
        continue;
      }
      const made = light.kind === "directional" ? this.sun(light.direction, light.color) : this.pointLight(light, pointLights++ < SHADOWED_POINT_LIGHTS);
      const strength = (light.color[0] + light.color[1] + light.color[2]) / 3;
      fill += light.kind === "directional" ? strength * Math.max(0, light.direction[2]) : 0.3 * strength;
      this.lit.push(made);
      this.scene.add(made);
    }
    this.scene.environmentRotation.y = environment?.turn ?? 0;
    this.scene.environment = environment ? this.environmentTexture(environment) : this.daylight;
    this.scene.environmentIntensity = environment ? (environment.color[0] + environment.color[1] + environment.color[2]) / 3 : (FILL * fill) / Math.PI;
    this.renderer.shadowMap.needsUpdate = true;
  }

  private sun(direction: readonly [number, number, number], color: readonly number[]): DirectionalLight {
    const { center, radius } = this.bounds;
    const sun = new DirectionalLight(new Color(...(color as [number, number, number])), 1);
    sun.target.position.copy(center);
    sun.position.copy(center).addScaledVector(toThree(direction as never).normalize(), 2 * radius);
    sun.target.updateMatrixWorld();
    sun.castShadow = true;
    const { camera } = sun.shadow;
    camera.left = camera.bottom = -radius;
    camera.right = camera.top = radius;
    camera.near = radius * 0.5;
    camera.far = radius * 3.5;
    sun.shadow.mapSize.set(SHADOW_SIZE, SHADOW_SIZE);
    sun.shadow.normalBias = (3 * radius) / SHADOW_SIZE;
    return sun;
  }

  /** The irradiance at distance a0 in three's candelas. */
  private pointLight(light: PunctualLight, shadow: boolean): PointLight | SpotLight {
    const [decay, intensity] = light.falloff === "linear" ? [1, light.a0] : [2, light.a0 ** 2];
    const color = new Color(...(light.color as [number, number, number]));
    const pointLight =
      light.kind === "spot"
        ? new SpotLight(color, intensity, 0, Math.min(light.outer, Math.PI / 2 - 1e-3), 1 - Math.min(1, light.inner / Math.max(light.outer, 1e-6)), decay)
        : new PointLight(color, intensity, 0, decay);
    pointLight.position.copy(toThree(light.position as never));
    if (pointLight instanceof SpotLight && light.kind === "spot") {
      pointLight.target.position.copy(pointLight.position).add(toThree(light.direction as never));
      pointLight.target.updateMatrixWorld();
    }
    pointLight.castShadow = shadow;
    pointLight.shadow.mapSize.set(SHADOW_SIZE / 2, SHADOW_SIZE / 2);
    pointLight.shadow.camera.near = this.bounds.radius * 0.005;
    pointLight.shadow.camera.far = this.bounds.radius * 6;
    pointLight.shadow.normalBias = (6 * this.bounds.radius) / SHADOW_SIZE;
    return pointLight;
  }

  /** An environment map, its top row +z and its middle column +x of Blender's world. */
  private environmentTexture(light: EnvironmentLight): Texture {
    const key = light.pixels as object;
    let found = this.environments.get(key);
    if (!found) {
      const { width, height, pixels } = light;
      const data = new Float32Array(4 * width * height);
      for (let r = 0; r < height; ++r) {
        for (let x = 0; x < width; ++x) {
          for (let c = 0; c < 3; ++c) data[4 * ((height - 1 - r) * width + x) + c] = pixels[3 * (r * width + x) + c];
        }
      }
      const image = new DataTexture(data as never, width, height, RGBAFormat, FloatType);
      image.mapping = EquirectangularReflectionMapping;
      image.magFilter = image.minFilter = LinearFilter;
      image.needsUpdate = true;
      found = this.pmrem.fromEquirectangular(image).texture;
      image.dispose();
      this.environments.set(key, found);
    }
    return found;
  }
}

function isGlass(material: Material): boolean {
  return ((material as MeshPhysicalMaterial).transmission ?? 0) > 0;
}

/** Daylight for reflections: bright near the zenith, over a dim ground. */
function daylight(): Scene {
  const scene = new Scene();
  const material = new ShaderMaterial({
    side: BackSide,
    depthWrite: false,
    vertexShader: "varying vec3 towards; void main() { towards = position; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }",
    fragmentShader: `varying vec3 towards;
void main() {
    float h = normalize(towards).y;
    vec3 above = mix(vec3(0.95, 0.97, 1.0), vec3(1.6, 1.75, 2.0), smoothstep(0.0, 0.9, h));
    gl_FragColor = vec4(mix(vec3(0.16, 0.15, 0.14), above, smoothstep(-0.05, 0.08, h)), 1.0);
}`,
  });
  scene.add(new Mesh(new SphereGeometry(10, 32, 16), material));
  return scene;
}

/** What a receiver's texture holds, and whether it is known at the vertices alone. */
interface ReceivedLight {
  quantity: "irradiance" | "radiance";
  atVertices?: boolean;
}

const RECEIVER_VERTEX = `precision highp float;
precision highp sampler2D;
in vec3 position;
in vec2 lightmapUv;
#ifdef COLORED
in vec4 color;
#endif
uniform mat4 modelMatrix, viewMatrix, projectionMatrix, litFromScene;
out vec3 vPlace;
#ifdef TEXTURED
in vec2 surfaceUv;
uniform mat3 surfaceTransform;
out vec2 vSurfaceUv;
#endif
out vec2 vUv;
out vec3 vColor;
#ifdef AT_VERTICES
uniform sampler2D relit, reference, ambient;
out vec3 vRelit, vReference, vAmbient;
#endif
void main() {
    vUv = lightmapUv;
#ifdef AT_VERTICES
    vRelit = textureLod(relit, lightmapUv, 0.0).rgb;
    vReference = textureLod(reference, lightmapUv, 0.0).rgb;
    vAmbient = textureLod(ambient, lightmapUv, 0.0).rgb;
#endif
    vColor = vec3(1.0);
#ifdef COLORED
    vColor = color.rgb;
#endif
#ifdef TEXTURED
    vSurfaceUv = (surfaceTransform * vec3(surfaceUv, 1.0)).xy;
#endif
    vec4 world = modelMatrix * vec4(position, 1.0);
    vPlace = (litFromScene * world).xyz;
    gl_Position = projectionMatrix * viewMatrix * world;
}`;

const RECEIVER_FRAGMENT = `precision highp float;
precision highp sampler2D;
in vec2 vUv;
in vec3 vColor;
uniform sampler2D relit, reference, ambient;
uniform vec3 referenceColor, albedo;
uniform float split, texelShare;
${PIXEL_LIGHT}
#ifdef AT_VERTICES
in vec3 vRelit, vReference, vAmbient;
#define AT(texels, vertex) vertex
#else
#define AT(texels, vertex) textureLod(texels, vUv, 0.0).rgb
#endif
#ifdef TEXTURED
in vec2 vSurfaceUv;
uniform sampler2D surface;
#endif
out vec4 radiance;
void main() {
    vec3 light = gl_FragCoord.x < split ? AT(reference, vReference) * referenceColor + AT(ambient, vAmbient) : texelShare * AT(relit, vRelit) + directAt();
#ifdef IRRADIANCE
    light *= albedo * vColor / 3.14159265358979;
#ifdef TEXTURED
    light *= texture(surface, vSurfaceUv).rgb;
#endif
#endif
    radiance = vec4(max(light, vec3(0.0)), 1.0);
}`;

/** The relit lightmap with the albedo of the mesh's own material: irradiance × albedo / π; radiance unchanged. */
function receiverMaterial(mesh: Mesh, uniforms: ScreenUniforms, { quantity, atVertices = false }: ReceivedLight): RawShaderMaterial {
  const surface = mesh.userData.surface as MeshStandardMaterial | undefined;
  const { geometry } = mesh;
  const map = surface?.map ?? null;
  const own: Record<string, IUniform> = { albedo: { value: new Vector3(1, 1, 1) } };
  if (surface?.color) own.albedo.value.set(surface.color.r, surface.color.g, surface.color.b);
  const uv = map && geometry.getAttribute(map.channel ? `uv${map.channel}` : "uv");
  if (map && uv) {
    geometry.setAttribute("surfaceUv", uv);
    map.updateMatrix();
    own.surface = { value: map };
    own.surfaceTransform = { value: map.matrix };
  }
  const defines: Record<string, string> = {};
  if (quantity === "irradiance") defines.IRRADIANCE = "";
  if (atVertices) defines.AT_VERTICES = "";
  if (map && uv) defines.TEXTURED = "";
  if (geometry.getAttribute("color")) defines.COLORED = "";
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    defines,
    uniforms: { ...uniforms, ...own },
    vertexShader: RECEIVER_VERTEX,
    fragmentShader: RECEIVER_FRAGMENT,
    side: surface?.side ?? 2,
  });
}
