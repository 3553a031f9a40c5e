/** Direct light at the pixels that show a lightmap's mesh: shadows are as sharp as the screen, where those of texels would show the texels. */
import {
  DoubleSide,
  FloatType,
  FrontSide,
  GLSL3,
  HalfFloatType,
  LinearFilter,
  type Material,
  Matrix4,
  Mesh,
  NearestFilter,
  type PerspectiveCamera,
  RawShaderMaterial,
  RGBAFormat,
  Scene,
  type Side,
  type Texture,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import type { Asset, Light } from "../src";
import { carried, columnMajor, multiplied, Z_UP_FROM_Y_UP } from "../src/matrix";
import { floatTexture } from "../src/three/float_textures";
import { undisturbed } from "../src/three/fullscreen";
import type { BallState } from "./ball_state";
import { type DirectInputs, DirectLight, reflectanceOf } from "./direct_light";

const VERTEX = `precision highp float;
in vec3 position, normal;
in vec2 lightmapUv;
uniform mat4 modelMatrix, viewMatrix, projectionMatrix, litFromScene;
out vec3 vPlace, vNormal;
out vec2 vUv;
void main() {
    vec4 world = modelMatrix * vec4(position, 1.0);
    vPlace = (litFromScene * world).xyz;
    vNormal = mat3(litFromScene) * (transpose(inverse(mat3(modelMatrix))) * normal);
    vUv = lightmapUv;
    gl_Position = projectionMatrix * viewMatrix * world;
}`;

// The baked normal, bumps included, unless it differs so much from the mesh's that it is of another surface.
const FRAGMENT = `precision highp float;
precision highp sampler2D;
in vec3 vPlace, vNormal;
in vec2 vUv;
uniform sampler2D bakedNormal, bakedReflectance;
layout(location = 0) out vec4 point;
layout(location = 1) out vec4 facing;
layout(location = 2) out vec4 reflectance;
const float SAME = 0.5;
void main() {
    vec3 own = vNormal / max(length(vNormal), 1e-20);
    vec3 baked = textureLod(bakedNormal, vUv, 0.0).xyz;
    baked /= max(length(baked), 1e-20);
    float agreement = dot(own, baked);
    point = vec4(vPlace, 1.0);
    facing = vec4(abs(agreement) > SAME || own == vec3(0.0) ? baked : agreement < 0.0 ? -own : own, 0.0);
    reflectance = textureLod(bakedReflectance, vUv, 0.0);
}`;

/** In a mesh's shader: the light of its pixel, at edges that of whichever pixel beside shows the same place. */
export const PIXEL_LIGHT = `in vec3 vPlace;
uniform sampler2D direct, directPoints;
uniform bool atPixels;

vec3 directAt() {
    if (!atPixels) return vec3(0.0);
    const ivec2 STEPS[5] = ivec2[](ivec2(0), ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1));
    ivec2 found;
    float least = 1e30;
    for (int i = 0; i < 5; ++i) {
        ivec2 at = clamp(ivec2(gl_FragCoord.xy) + STEPS[i], ivec2(0), textureSize(direct, 0) - 1);
        vec4 point = texelFetch(directPoints, at, 0);
        float away = point.a > 0.0 ? distance(point.xyz, vPlace) : 1e29;
        if (away < least) {
            least = away;
            found = at;
        }
    }
    return texelFetch(direct, found, 0).rgb;
}
`;

/** Uniforms of PIXEL_LIGHT, and `litFromScene`, by which a vertex shader makes `vPlace` of a place in three's world. */
export const pixelUniforms = () => ({
  direct: { value: null as Texture | null },
  directPoints: { value: null as Texture | null },
  atPixels: { value: false },
  litFromScene: { value: new Matrix4() },
  texelShare: { value: 1 }, // of the texels' light; 0 where pixels have all that is shown
});

/** Of a mesh that is lit by its texels alone, whatever others are. */
export const byTexels = () => ({ atPixels: { value: false }, texelShare: { value: 1 } });

/** Pixels of the picture, and which sides of the mesh it shows. */
interface Seen {
  width: number;
  height: number;
  sides: "front" | "both" | "as in the file";
}

export class PixelLight {
  private readonly scene = new Scene();
  private readonly meshes: { own: Mesh; isSingle: boolean }[] = [];
  private readonly surfaces = new WebGLRenderTarget(1, 1, { count: 3, type: FloatType, format: RGBAFormat, minFilter: NearestFilter, magFilter: NearestFilter });
  private readonly light: DirectLight;
  private readonly litFromScene: Matrix4;
  private readonly materials: { front: RawShaderMaterial; both: RawShaderMaterial };
  private drawn = "";

  /** `meshes` have `lightmapUv`. @throws SrbfError where the GPU cannot blend floats. */
  constructor(
    private readonly asset: Asset,
    inputs: DirectInputs,
    meshes: readonly Mesh[],
    private readonly renderer: WebGLRenderer,
  ) {
    const [points, normals, reflectance] = this.surfaces.textures;
    normals.type = reflectance.type = HalfFloatType;
    this.light = DirectLight.ofPixels(asset, inputs, { points, normals, reflectance }, renderer);
    const { width, height } = asset.manifest;
    const baked = new Float32Array(4 * width * height);
    for (let i = 0; i < width * height; ++i) for (let c = 0; c < 3; ++c) baked[4 * i + c] = inputs.normal.data[inputs.normal.channels * i + c];
    this.litFromScene = new Matrix4().makeTranslation(...(this.light.center.map((x) => -x) as [number, number, number]));
    this.litFromScene.multiply(new Matrix4().fromArray(columnMajor(multiplied(asset.assetFromWorld, Z_UP_FROM_Y_UP))));
    const smooth = (data: Float32Array): Texture => {
      const made = floatTexture(data, width, height);
      if (renderer.extensions.has("OES_texture_float_linear")) made.magFilter = made.minFilter = LinearFilter;
      return made;
    };
    const uniforms = { litFromScene: { value: this.litFromScene }, bakedNormal: { value: smooth(baked) }, bakedReflectance: { value: asset.manifest.quantity === "irradiance" ? floatTexture(new Float32Array([1, 1, 1, 1]), 1, 1) : smooth(reflectanceOf(asset, inputs.albedo, 1)) } };
    const material = (side: Side) => new RawShaderMaterial({ glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms, side });
    this.materials = { front: material(FrontSide), both: material(DoubleSide) };
    for (const mesh of meshes) {
      const own = new Mesh(mesh.geometry, this.materials.both);
      own.matrixAutoUpdate = false;
      own.matrix.copy(mesh.matrixWorld);
      this.scene.add(own);
      this.meshes.push({ own, isSingle: (mesh.userData.surface as Material | undefined)?.side === FrontSide });
    }
    this.scene.updateMatrixWorld(true);
  }

  /** The sphere that casts shadows, in the asset's world. */
  setBall(ball?: BallState): void {
    this.light.setBall(ball && { position: carried(this.asset.assetFromWorld, ball.position), size: ball.size });
  }

  /** Give its pixels' memory back until it is drawn again. */
  rest(): void {
    this.surfaces.setSize(1, 1);
    this.light.resize(1, 1);
    this.drawn = "";
  }

  /** Put the light of `lights` at the pixels that `camera` sees into `uniforms`; whether these are others than before, and it was drawn again. */
  draw(uniforms: ReturnType<typeof pixelUniforms>, lights: readonly Light[], camera: PerspectiveCamera, { width, height, sides }: Seen): boolean {
    const { renderer, surfaces, light } = this;
    camera.updateMatrixWorld(); // as three does before it draws
    const state = JSON.stringify([camera.matrixWorld.elements, camera.projectionMatrix.elements, width, height, sides]);
    const changed = state !== this.drawn;
    if (changed) {
      this.drawn = state;
      for (const { own, isSingle } of this.meshes) own.material = sides === "front" || (sides === "as in the file" && isSingle) ? this.materials.front : this.materials.both;
      surfaces.setSize(width, height);
      light.resize(width, height);
      undisturbed(renderer, () => {
        renderer.setRenderTarget(surfaces);
        renderer.setClearColor(0, 0);
        renderer.clear();
        renderer.render(this.scene, camera);
      });
    }
    uniforms.direct.value = light.draw(lights);
    uniforms.directPoints.value = surfaces.textures[0];
    uniforms.litFromScene.value = this.litFromScene;
    return changed;
  }
}
