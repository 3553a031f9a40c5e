import { describe, expect, it } from "vitest";
import { decodeDds } from "../src/dds";
import { decodeKtx2 } from "../src/ktx2";
import { checkStack, levelBytes } from "../src/layers";

/** A DDS file of `layers` RGBA8 arrays of 4 x 2 texels with `levels`, bytes counted upwards. */
function dds(layers: number, levels: number, format = 28): ArrayBuffer {
  const size = Array.from({ length: levels }, (_, l) => levelBytes("uint8", 4, 2, l)).reduce((a, b) => a + b, 0);
  const buffer = new ArrayBuffer(148 + layers * size);
  const view = new DataView(buffer);
  for (const [at, value] of [[0, 0x20534444], [12, 2], [16, 4], [28, levels], [84, 0x30315844], [128, format], [140, layers]]) view.setUint32(at, value, true);
  new Uint8Array(buffer, 148).forEach((_, i, all) => {
    all[i] = i;
  });
  return buffer;
}

describe("DDS", () => {
  it("gathers each level of all layers", () => {
    const stack = decodeDds(dds(2, 2), "maps.dds");
    expect(stack).toMatchObject({ width: 4, height: 2, count: 2, encoding: "uint8" });
    expect([...stack.levels[0]]).toEqual([...Array(32).keys(), ...Array.from({ length: 32 }, (_, i) => 40 + i)]);
    expect([...stack.levels[1]]).toEqual([...Array.from({ length: 8 }, (_, i) => 32 + i), ...Array.from({ length: 8 }, (_, i) => 72 + i)]);
  });

  it("says what is wrong", () => {
    expect(() => decodeDds(new ArrayBuffer(200), "x.dds")).toThrow("expected a DDS file with the DX10 header at x.dds");
    expect(() => decodeDds(dds(1, 1, 99), "x.dds")).toThrow("found DXGI format 99");
    expect(() => decodeDds(dds(2, 1).slice(0, 180), "x.dds")).toThrow("it is cut short");
    expect(() => checkStack(decodeDds(dds(2, 1), "x.dds"), { width: 4, height: 2, count: 3, encoding: "uint8" }, "x.dds")).toThrow("expected count 3");
  });
});

describe("KTX2", () => {
  it("names a damaged file", () => {
    expect(() => decodeKtx2(new ArrayBuffer(100), "x.ktx2")).toThrow("cannot read x.ktx2");
  });
});

describe("levels", () => {
  it("are halved, rounded down, and blocks begun are whole", () => {
    expect([0, 1, 2, 3, 4].map((l) => levelBytes("bc7", 14, 9, l))).toEqual([4 * 3 * 16, 2 * 16, 16, 16, 16]);
    expect(levelBytes("bc1", 8, 8, 0)).toBe(32);
    expect(levelBytes("half", 5, 3, 1)).toBe(2 * 1 * 8);
  });
});
