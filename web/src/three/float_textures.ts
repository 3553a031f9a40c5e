/** Textures and targets of single precision that are fetched by texel. */
import { DataTexture, FloatType, NearestFilter, RedFormat, RGBAFormat, WebGLRenderTarget } from "three";

export function floatTexture(data: Float32Array, width: number, height: number): DataTexture {
  return uploaded(new DataTexture(data as never, width, height, RGBAFormat, FloatType));
}

/** Of one channel. */
export function grayTexture(data: Float32Array, width: number, height: number): DataTexture {
  return uploaded(new DataTexture(data as never, width, height, RedFormat, FloatType));
}

export function floatTarget(width: number, height: number): WebGLRenderTarget {
  return new WebGLRenderTarget(width, height, { format: RGBAFormat, type: FloatType, magFilter: NearestFilter, minFilter: NearestFilter, depthBuffer: false });
}

function uploaded(texture: DataTexture): DataTexture {
  texture.needsUpdate = true;
  return texture;
}
