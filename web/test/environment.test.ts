import { DataTexture, DataUtils, FloatType, HalfFloatType, RGBAFormat, UnsignedByteType } from "three";
import { describe, expect, it } from "vitest";
import { environmentOf } from "../src/three/environment";

const RGBA = [1, 2, 3, 1, 4, 5, 6, 1, 7, 8, 9, 1, 10, 11, 12, 1]; // 2 x 2, the bottom row first

describe("environmentOf", () => {
  it("starts at the top, whatever way the texture lies", () => {
    const map = new DataTexture(new Float32Array(RGBA), 2, 2, RGBAFormat, FloatType);
    expect(Array.from(environmentOf(map, 0.5).pixels)).toEqual([7, 8, 9, 10, 11, 12, 1, 2, 3, 4, 5, 6]);
    map.flipY = true;
    expect(Array.from(environmentOf(map).pixels)).toEqual([1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]);
    expect(environmentOf(map, 0.5).color).toEqual([0.5, 0.5, 0.5]);
  });

  it("reads half floats", () => {
    const map = new DataTexture(Uint16Array.from(RGBA, DataUtils.toHalfFloat), 2, 2, RGBAFormat, HalfFloatType);
    expect(environmentOf(map).pixels[0]).toBe(7);
  });

  it("refuses bytes", () => {
    expect(() => environmentOf(new DataTexture(new Uint8Array(16), 2, 2, RGBAFormat, UnsignedByteType))).toThrow("floats or half floats");
  });
});
