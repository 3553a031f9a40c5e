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
import type { FloatImage } from "../image";

export type Filter = "linear" | "nearest";

const TYPES = { half: HalfFloatType, float: FloatType, uint8: UnsignedByteType } as const;

/** Everything that shaders read of one asset. `weights` of eigen maps changes with the lights. */
export class SrbfTextures {
  readonly layers: DataArrayTexture | CompressedArrayTexture;
  readonly ambient: DataTexture;
  /** The R table, or the atlas of light functions. */
  readonly table: DataTexture;
  readonly weights?: DataTexture;
  readonly clusters?: DataTexture;
  readonly positions?: DataTexture;
  /** Of a view that does not fill its picture. */
  readonly alpha?: DataTexture;

  /** Layers and ambient are filtered as asked, compressed layers by their mip levels too; clustered ones must be `nearest`. */
  constructor(asset: Asset, filter: Filter) {
    const { basis } = asset;
    this.layers = layersTexture(asset, filter);
    this.ambient = ambientTexture(asset.ambient, filter);
    if (asset.position) this.positions = rgbaTexture(asset.position.data, asset.position.width, asset.position.height, FloatType);
    if (asset.alpha) this.alpha = alphaTexture(asset.alpha);
    if (basis.kind === "gaussian") {
      this.table = plain(basis.table, basis.table.length, 1, RedFormat, FloatType);
      return;
    }
    const { wTable, scalars, clusters, clusterIndex } = basis;
    this.table = rgbaTexture(wTable.data, wTable.width, wTable.height, HalfFloatType);
    this.weights = rgbaTexture(new Float32Array(4 * (scalars + 1) * clusters), scalars + 1, clusters, FloatType);
    if (clusterIndex) this.clusters = plain(clusterIndex.data, clusterIndex.width, clusterIndex.height, RedFormat, UnsignedByteType);
  }

  dispose(): void {
    for (const texture of [this.layers, this.ambient, this.table, this.weights, this.clusters, this.positions, this.alpha]) texture?.dispose();
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
  const halves = Uint16Array.from(ambient.data, (value) => DataUtils.toHalfFloat(value)); // few GPUs of phones filter single floats
  return finished(rgbaTexture(halves, ambient.width, ambient.height, HalfFloatType), filter);
}

/** The share of every texel that is there, filtered: layers hold whole colors past its edge. */
export function alphaTexture({ data, width, height }: FloatImage): DataTexture {
  const halves = Uint16Array.from(data, (value) => DataUtils.toHalfFloat(value));
  return finished(plain(halves, width, height, RedFormat, HalfFloatType), "linear");
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
