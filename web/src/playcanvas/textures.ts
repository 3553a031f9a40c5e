/** An asset's images as PlayCanvas textures: texel (c, r) is row r, column c of the file, row 0 at the top, never flipped. */
import {
  ADDRESS_CLAMP_TO_EDGE,
  FILTER_LINEAR,
  FILTER_NEAREST,
  type GraphicsDevice,
  PIXELFORMAT_R16F,
  PIXELFORMAT_R32F,
  PIXELFORMAT_R8,
  PIXELFORMAT_RGBA16F,
  PIXELFORMAT_RGBA32F,
  PIXELFORMAT_RGBA8,
  Texture,
} from "playcanvas";
import type { Asset } from "../asset";
import { SrbfError } from "../errors";

const RED_FORMATS = { half: PIXELFORMAT_R16F, float: PIXELFORMAT_R32F, uint8: PIXELFORMAT_R8 };
const FORMATS = { half: PIXELFORMAT_RGBA16F, float: PIXELFORMAT_RGBA32F, uint8: PIXELFORMAT_RGBA8 };

/** By the name of the shader's sampler. `weights` changes with the lights. */
export class PlayCanvasTextures {
  readonly samplers: Record<string, Texture>;
  readonly weights?: Texture;

  /** @throws SrbfError on block-compressed layers, which this adapter does not upload. */
  constructor(asset: Asset, device: GraphicsDevice, filter: "linear" | "nearest") {
    const { width, height, count, encoding, levels } = asset.layers;
    if (encoding === "bc7" || encoding === "bc1") {
      throw new SrbfError(`expected half, float or uint8 layers for PlayCanvas, found ${encoding}; srbf export --target exr or png`);
    }
    const { tables, ambient } = asset;
    const size = width * height * 4;
    const layers = Array.from({ length: count }, (_, i) => levels[0].subarray(i * size, (i + 1) * size));
    const of = (data: ArrayBufferView | ArrayBufferView[], w: number, h: number, format: number, linear = false, arrayLength = 0) =>
      new Texture(device, {
        width: w,
        height: h,
        format,
        arrayLength,
        mipmaps: false,
        minFilter: linear ? FILTER_LINEAR : FILTER_NEAREST,
        magFilter: linear ? FILTER_LINEAR : FILTER_NEAREST,
        addressU: ADDRESS_CLAMP_TO_EDGE,
        addressV: ADDRESS_CLAMP_TO_EDGE,
        levels: [data] as never,
      });
    this.samplers = {
      srbfLayers: of(layers, width, height, FORMATS[encoding], filter === "linear" && asset.method.filterable(asset.manifest), count),
      srbfAmbient: of(ambient?.data ?? new Float32Array(4), ambient?.width ?? 1, ambient?.height ?? 1, PIXELFORMAT_RGBA32F),
    };
    for (const [name, image] of Object.entries(tables.textures)) {
      this.samplers[name] = of(image.data, image.width, image.height, (image.channels === 1 ? RED_FORMATS : FORMATS)[image.kind]);
    }
    const { kind, width: columns, height: rows } = tables.weights;
    if (kind === "texture") {
      this.weights = of(new Float32Array(4 * columns * rows), columns, rows, PIXELFORMAT_RGBA32F);
      this.samplers.srbfWeights = this.weights;
    }
    if (asset.alpha) this.samplers.srbfAlpha = of(Uint8Array.from(asset.alpha.data, (share) => Math.round(255 * share)), width, height, PIXELFORMAT_R8, true);
    if (asset.position) this.samplers.srbfPositions = of(asset.position.data, width, height, PIXELFORMAT_RGBA32F);
  }

  dispose(): void {
    for (const texture of Object.values(this.samplers)) texture.destroy();
  }
}
