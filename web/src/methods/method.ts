/** What a method is to the rest of this package. A method is one file in this folder, one line in `index.ts`, and its shader in `../shaders`. */
import type { LightsInAssetFrame } from "../asset_frame";
import type { EnvironmentTable } from "../environment_table";
import type { AssetFiles } from "../files";
import type { Gather } from "../gather";
import type { ByteImage, FloatImage, HalfImage } from "../image";
import type { Manifest } from "../manifest";
import type { Triple } from "../matrix";
import type { Surfaces } from "../surface_changes";
import type { Surfels } from "../surfels";
import type { N } from "../three/tsl/nodes";
import type { NodeKit } from "./node_kit";

/** Throws an SrbfError that names what the manifest should have and what it has. */
export type Fail = (expected: string, found: unknown) => never;

export interface ReadOptions {
  /** Weights of point lights inside a scene by rays, as `srbf relight` has them, in place of the asset's table: some 10 ms a light. */
  exact?: boolean;
}

export interface Method {
  /** `method` of asset.json. */
  readonly name: string;
  /** The key of asset.json that lists the stored layers. */
  readonly layersKey: string;
  /** Numbers in `scale` and `bias` of a layer. */
  readonly layerChannels: 3 | 4;
  /** Coefficient maps per stored layer: one in RGB, or four scalar ones, one per channel. */
  readonly mapsPerLayer: 1 | 4;
  /** Name of its coefficient maps in a title, such as "maps". */
  readonly mapsName: string;
  /** Whether layers may be filtered between texels; otherwise a lightmap is drawn from them first, and that is filtered. */
  filterable(manifest: Manifest): boolean;
  /**
   * GLSL ES 3.00 that declares the uniforms and `vec3 srbfSum(vec2 uv, float level, vec3 receiver)`, `srbfRelit` of the same parameters, and
   * `vec3 srbfRelitSurface(vec2 uv, vec3 receiver)`: see `shaderText`.
   */
  readonly shader: string;
  /** Check the keys of asset.json that only this method has; `layers` is the number of stored layers. */
  check(manifest: Manifest, layers: number, fail: Fail): void;
  /** Read the files that only this method has. @throws SrbfError on a damaged one. */
  read(files: AssetFiles, manifest: Manifest, options?: ReadOptions): Promise<Tables>;
}

/** What a method has read of one asset: everything but its layers. Names of uniforms and textures are those of its shader. */
export interface Tables {
  /** Unit directions of the centers of its light functions. */
  readonly centers: readonly Triple[];
  /** How many coefficient maps there are to look at. */
  readonly maps: number;
  /** Defines of its shader. */
  readonly defines: Readonly<Record<string, number>>;
  /** Uniform arrays of vec4 that do not change. */
  readonly vectors: Readonly<Record<string, Float32Array>>;
  /** Uniform integers. */
  readonly integers: Readonly<Record<string, number>>;
  /** Textures that are fetched by texel, never filtered. */
  readonly textures: Readonly<Record<string, FloatImage | HalfImage | ByteImage>>;
  /** Layers (RGBA bytes) that its shader finds after the stored ones, of methods whose layers are bytes. */
  readonly furtherLayers?: readonly Uint8Array[];
  /** Where the shader takes the projected weights from, as `srbfWeights`: an array of `width` vec4, or an RGBA32F texture. */
  readonly weights: { readonly kind: "uniform" | "texture"; readonly width: number; readonly height: number };
  /** Names of its lights, of assets of named ones. */
  readonly names?: readonly string[];
  /** Places of free space (m), of assets of lights inside the scene. */
  readonly places?: readonly Triple[];
  /** Whether point and spot lights are part of the projected weights; otherwise the shader adds them. */
  readonly projectsPunctual?: boolean;
  /** What a GPU needs to compute the weights of lights inside a scene itself, of assets with rays. */
  readonly surfels?: Surfels;
  /** Surfels and links, of deep framebuffers. */
  readonly gather?: Gather;
  /** Environments by the directions that the surfels see, of assets of transfer in open scenes. */
  readonly environment?: EnvironmentTable;
  /** Objects that emit or are repainted, of assets fitted with `--editable`. */
  readonly surfaces?: Surfaces;
  /** Sum over lights of color times light function: RGB for each function, (F, 3), F = width * height of `weights`; or what else the shader takes as such. */
  projectedWeights(lights: LightsInAssetFrame): Float64Array;
  /** `srbfSum` in three.js' node language: the light of all lights at `uv` (v downwards), before the clamp; `receiver` in the asset's frame, meters. */
  sum(kit: NodeKit, uv: N, receiver: N): N;
}
