/** An asset's images as Babylon.js textures: texel (c, r) is row r, column c of the file, row 0 at the top, never flipped. */
import { Constants } from "@babylonjs/core/Engines/constants.js";
import { RawTexture } from "@babylonjs/core/Materials/Textures/rawTexture.js";
import { RawTexture2DArray } from "@babylonjs/core/Materials/Textures/rawTexture2DArray.js";
import { Texture } from "@babylonjs/core/Materials/Textures/texture.js";
import type { Scene } from "@babylonjs/core/scene.js";
import type { Asset } from "../asset";
import { SrbfError } from "../errors";

const TYPES = { half: Constants.TEXTURETYPE_HALF_FLOAT, float: Constants.TEXTURETYPE_FLOAT, uint8: Constants.TEXTURETYPE_UNSIGNED_BYTE };
const { TEXTUREFORMAT_R, TEXTUREFORMAT_RGBA, TEXTURETYPE_FLOAT } = Constants;

/** By the name of the shader's sampler. `weights` changes with the lights. */
export class BabylonTextures {
  readonly samplers: Record<string, Texture>;
  readonly weights?: RawTexture;

  /** @throws SrbfError on block-compressed layers, for which Babylon.js has no texture arrays. */
  constructor(asset: Asset, scene: Scene, filter: "linear" | "nearest") {
    const { width, height, count, encoding, levels } = asset.layers;
    if (encoding === "bc7" || encoding === "bc1") {
      throw new SrbfError(`expected half, float or uint8 layers for Babylon.js, found ${encoding}; srbf export --target exr or png`);
    }
    const sampling = filter === "linear" && asset.method.filterable(asset.manifest) ? Texture.BILINEAR_SAMPLINGMODE : Texture.NEAREST_SAMPLINGMODE;
    const plain = (data: ArrayBufferView, w: number, h: number, format: number, type: number) =>
      new RawTexture(data, w, h, format, scene, false, false, Texture.NEAREST_SAMPLINGMODE, type);
    const { tables, ambient } = asset;
    this.samplers = {
      srbfLayers: new RawTexture2DArray(levels[0], width, height, count, TEXTUREFORMAT_RGBA, scene, false, false, sampling, TYPES[encoding]),
      srbfAmbient: plain(ambient?.data ?? new Float32Array(4), ambient?.width ?? 1, ambient?.height ?? 1, TEXTUREFORMAT_RGBA, TEXTURETYPE_FLOAT),
    };
    for (const [name, { data, width: w, height: h, channels, kind }] of Object.entries(tables.textures)) {
      this.samplers[name] = plain(data, w, h, channels === 1 ? TEXTUREFORMAT_R : TEXTUREFORMAT_RGBA, TYPES[kind]);
    }
    const { kind, width: columns, height: rows } = tables.weights;
    if (kind === "texture") {
      this.weights = plain(new Float32Array(4 * columns * rows), columns, rows, TEXTUREFORMAT_RGBA, TEXTURETYPE_FLOAT);
      this.samplers.srbfWeights = this.weights;
    }
    if (asset.alpha) {
      const shares = Uint8Array.from(asset.alpha.data, (share) => Math.round(255 * share));
      this.samplers.srbfAlpha = new RawTexture(shares, width, height, TEXTUREFORMAT_R, scene, false, false, Texture.BILINEAR_SAMPLINGMODE, TYPES.uint8);
    }
    if (asset.position) {
      this.samplers.srbfPositions = plain(asset.position.data, width, height, TEXTUREFORMAT_RGBA, TEXTURETYPE_FLOAT);
    }
    for (const texture of Object.values(this.samplers)) texture.wrapU = texture.wrapV = Texture.CLAMP_ADDRESSMODE;
  }

  dispose(): void {
    for (const texture of Object.values(this.samplers)) texture.dispose();
  }
}
