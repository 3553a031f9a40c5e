/** An asset's images as three.js textures: texel (c, r) of every texture is row r, column c of the file, row 0 at the top, never flipped. */
import {
  ClampToEdgeWrapping,
  CompressedArrayTexture,
  DataArrayTexture,
  DataTexture,
  DataUtils,
  FloatType,
  HalfFloatType,
  LinearFilter,
  LinearMipmapLinearFilter,
  NearestFilter,
  NoColorSpace,
  type PixelFormat,
  RedFormat,
  RGB_S3TC_DXT1_Format,
  RGBA_BPTC_Format,
  RGBAFormat,
  type Texture,
  type TextureDataType,
  UnsignedByteType,
} from "three";
import type { Asset } from "../asset";
import type { ByteImage, FloatImage, HalfImage } from "../image";

export type Filter = "linear" | "nearest";

const TYPES = { half: HalfFloatType, float: FloatType, uint8: UnsignedByteType } as const;

/** The textures that the shaders of one asset read. `weights` changes with the lights. */
export class SrbfTextures {
  readonly layers: DataArrayTexture | CompressedArrayTexture;
  readonly ambient: DataTexture;
  /** Those that only the asset's method has, by the name of the shader's sampler. */
  readonly tables: Readonly<Record<string, DataTexture>>;
  /** The projected weights, where the method's shader reads them from a texture. */
  readonly weights?: DataTexture;
  readonly positions?: DataTexture;
  /** Coverage of a view that does not fill its picture. */
  readonly alpha?: DataTexture;

  /** Layers and ambient are filtered as asked, compressed layers by their mip levels too; layers that are not filterable must be `nearest`. */
  constructor(asset: Asset, filter: Filter) {
    this.layers = layersTexture(asset, filter);
    this.ambient = ambientTexture(asset.ambient, filter);
    if (asset.position) this.positions = rgbaTexture(asset.position.data, asset.position.width, asset.position.height, FloatType);
    if (asset.alpha) this.alpha = alphaTexture(asset.alpha);
    const { textures, weights } = asset.tables;
    this.tables = Object.fromEntries(Object.entries(textures).map(([name, image]) => [name, tableTexture(image)]));
    if (weights.kind === "texture") {
      this.weights = rgbaTexture(new Float32Array(4 * weights.width * weights.height), weights.width, weights.height, FloatType);
    }
  }

  dispose(): void {
    const own = [this.layers, this.ambient, this.weights, this.positions, this.alpha];
    for (const texture of [...own, ...Object.values(this.tables)]) texture?.dispose();
  }
}

function layersTexture(asset: Asset, filter: Filter): DataArrayTexture | CompressedArrayTexture {
  const { width, height, count, encoding, levels } = asset.layers;
  let texture: DataArrayTexture | CompressedArrayTexture;
  if (encoding === "bc7" || encoding === "bc1") {
    const mipmaps = levels.map((data, l) => ({ data: data as Uint8Array, width: Math.max(1, width >> l), height: Math.max(1, height >> l) }));
    const format = encoding === "bc7" ? RGBA_BPTC_Format : RGB_S3TC_DXT1_Format;
    texture = new CompressedArrayTexture(mipmaps as never, width, height, count, format as never, UnsignedByteType);
  } else {
    texture = new DataArrayTexture(levels[0] as never, width, height, count);
    texture.format = RGBAFormat;
    texture.type = TYPES[encoding];
  }
  finished(texture, filter);
  if (filter === "linear" && texture.mipmaps && texture.mipmaps.length > 1) texture.minFilter = LinearMipmapLinearFilter;
  return texture;
}

function ambientTexture(ambient: FloatImage | undefined, filter: Filter): DataTexture {
  if (!ambient) return rgbaTexture(new Float32Array(4), 1, 1, FloatType);
  if (filter === "nearest") return rgbaTexture(ambient.data, ambient.width, ambient.height, FloatType);
  const halves = Uint16Array.from(ambient.data, (value) => DataUtils.toHalfFloat(value)); // few mobile GPUs filter single floats
  return finished(rgbaTexture(halves, ambient.width, ambient.height, HalfFloatType), filter);
}

/** Coverage, filtered: layers hold straight colors past its edge. */
export function alphaTexture({ data, width, height }: FloatImage): DataTexture {
  const halves = Uint16Array.from(data, (value) => DataUtils.toHalfFloat(value));
  return finished(plain(halves, width, height, RedFormat, HalfFloatType), "linear");
}

export function tableTexture({ data, width, height, kind, channels }: FloatImage | HalfImage | ByteImage): DataTexture {
  return plain(data, width, height, channels === 1 ? RedFormat : RGBAFormat, TYPES[kind]);
}

function rgbaTexture(data: ArrayBufferView, width: number, height: number, type: TextureDataType): DataTexture {
  return plain(data, width, height, RGBAFormat, type);
}

function plain(data: ArrayBufferView, width: number, height: number, format: PixelFormat, type: TextureDataType): DataTexture {
  return finished(new DataTexture(data as never, width, height, format, type), "nearest");
}

function finished<T extends Texture>(texture: T, filter: Filter): T {
  texture.colorSpace = NoColorSpace;
  texture.magFilter = texture.minFilter = filter === "linear" ? LinearFilter : NearestFilter;
  texture.wrapS = texture.wrapT = ClampToEdgeWrapping;
  texture.generateMipmaps = false;
  texture.flipY = false;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}
