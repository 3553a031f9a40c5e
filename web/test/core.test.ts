import { describe, expect, it } from "vitest";
import {
  checkManifest,
  directionalLight,
  environmentLight,
  IDENTITY,
  pointLightUniforms,
  loadAsset,
  methodNamed,
  moved,
  multiplied,
  pointLight,
  receiverKind,
  shaderText,
  SrbfError,
  spotLight,
  type Asset,
  type Triple,
} from "../src";
import { checkCompression } from "../src/compression";
import { lookup } from "../src/gaussian";
import { flipRows, padToFour } from "../src/image";
import { insidePath } from "../src/manifest";
import { Z_UP_FROM_Y_UP } from "../src/matrix";

const MANIFEST = {
  format: "srbf-asset",
  version: 1,
  method: "relighting-map",
  quantity: "irradiance",
  width: 2,
  height: 3,
  domain: "sphere",
  basis: { kind: "gaussian", centers: [[0, 0, 1]], spread: 0.5 },
  maps: [{ file: "map_00.exr", encoding: "half", scale: [1, 1, 1], bias: [0, 0, 0] }],
  r_table: { file: "r_table.exr", size: 16 },
};

describe("lights", () => {
  it("normalizes directions and refuses zero ones", () => {
    expect(directionalLight([0, 3, 4]).direction).toEqual([0, 0.6, 0.8]);
    expect(directionalLight([0, 3e200, 4e200]).direction).toEqual([0, 0.6, 0.8]);
    expect(() => directionalLight([0, 0, 0])).toThrow("expected a direction of non-zero, finite length");
  });

  it("refuses numbers that no point light can have", () => {
    expect(() => pointLight([0, 0, 1], { a0: 0 })).toThrow("expected a0 above 0, found 0");
    expect(() => pointLight([0, Number.NaN, 1])).toThrow("expected position as three finite numbers");
    expect(() => spotLight([0, 0, 1], [0, 0, -1], { inner: 0.5, outer: 0.4 })).toThrow("expected spot half-angles");
    expect(() => environmentLight(2, 1, [1, 1, 1])).toThrow("expected 2 x 1 x 3 numbers");
    expect(() => environmentLight(1, 1, [1, Number.POSITIVE_INFINITY, 1])).toThrow("NaN or Inf");
  });

  it("scales a point light's a0 and radius with the frame", () => {
    const doubled = multiplied([[2, 0, 0, 1], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]], IDENTITY);
    expect(moved(pointLight([1, 0, 0], { a0: 1.5, radius: 0.1 }), doubled)).toMatchObject({ position: [3, 0, 0], a0: 3, radius: 0.2 });
  });

  it("turns y up into z up as glTF does", () => {
    expect(moved(directionalLight([0, 1, 0]), Z_UP_FROM_Y_UP).direction).toEqual([0, 0, 1]);
    expect(moved(directionalLight([0, 0, 1]), Z_UP_FROM_Y_UP).direction.map((x) => x + 0)).toEqual([0, -1, 0]);
  });

  it("keeps what single precision drops of a position", () => {
    const position: Triple = [1e4 + 1e-5, -1 / 3, 0];
    const { position: high, positionLow: low } = pointLightUniforms(pointLight(position));
    expect(high).toEqual(position.map(Math.fround));
    expect(high.map((x, i) => x + low[i])).toEqual(position);
  });
});

describe("tables and images", () => {
  it("mixes neighboring entries and clips cosines", () => {
    const table = new Float32Array([0, 1, 4]);
    expect([-2, -1, -0.5, 0, 0.5, 1, 2].map((x) => lookup(table, x))).toEqual([0, 0, 0.5, 1, 2.5, 4, 4]);
  });

  it("turns rows over, odd counts too", () => {
    const rows = new Float32Array([1, 2, 3, 4, 5, 6]);
    flipRows(rows, 3);
    expect([...rows]).toEqual([5, 6, 3, 4, 1, 2]);
  });

  it("pads three channels with 255 and leaves four alone", () => {
    expect([...padToFour(new Uint8Array([1, 2, 3, 4, 5, 6]), 3)]).toEqual([1, 2, 3, 255, 4, 5, 6, 255]);
    const four = new Uint8Array([1, 2, 3, 0]);
    expect(padToFour(four, 4)).toBe(four);
  });
});

describe("manifests", () => {
  it("takes what the schema takes, unknown keys included", () => {
    expect(checkManifest({ ...MANIFEST, novelty: 1 }, "asset.json").width).toBe(2);
  });

  it.each([
    [{ format: "srbf-capture" }, "expected format srbf-asset in asset.json"],
    [{ version: 2 }, "expected version 1"],
    [{ method: "magic" }, "expected a method of relighting-map, eigen-map, clustered-eigen-map"],
    [{ basis: { kind: "ptm" } }, "expected maps of Gaussians"],
    [{ basis: { kind: "gaussian", centers: [], spread: 1 } }, "expected as many centers as maps"],
    [{ maps: [] }, "expected maps"],
    [{ maps: [{ ...MANIFEST.maps[0], encoding: "jpeg" }] }, "expected an encoding of half"],
    [{ receiver: { kind: "room" } }, "expected a receiver of lightmap, view, vertices"],
    [{ width: 0 }, "expected width of at least 1"],
    [{ method: "eigen-map", scalars: 5, planes: [{ file: "p", encoding: "half", scale: [1, 1, 1, 1], bias: [0, 0, 0, 0] }] }, "scalars four to an image"],
    [{ method: "neural-map", scalars: 4, planes: [{ file: "p", encoding: "half", scale: [1, 1, 1, 1], bias: [0, 0, 0, 0] }], network: { hidden: 6 } }, "a network of a multiple of 4 hidden units"],
  ])("refuses %j", (change, message) => {
    expect(() => checkManifest({ ...MANIFEST, ...change }, "asset.json")).toThrow(message);
  });

  it("read the receiver's kind from its own key, and from the source of assets that lack it", () => {
    const kind = (keys: object) => receiverKind(checkManifest({ ...MANIFEST, ...keys }, "asset.json"));
    expect(kind({ receiver: { kind: "view" }, source: { receiver: { kind: "lightmap" } } })).toBe("view");
    expect(kind({ receivers: [{ kind: "lightmap" }, { kind: "lightmap" }] })).toBe("lightmap");
    expect(kind({ source: { receiver: { kind: "vertices" } } })).toBe("vertices");
    expect(kind({ source: { receivers: [{ kind: "lightmap" }] } })).toBe("lightmap");
    expect(kind({})).toBeUndefined();
  });

  it("keeps files inside the folder", () => {
    expect(insidePath("maps/map 1.exr")).toBe("maps/map%201.exr");
    for (const name of ["../x", "/etc/x", "a\\b", "http://x/y", ""]) expect(() => insidePath(name)).toThrow(SrbfError);
  });
});

describe("loading", () => {
  const serving = (status: number, body: string) => async () => new Response(body, { status });

  it("says what a server did not have", async () => {
    await expect(loadAsset("http://x/a", { fetch: serving(404, "") })).rejects.toThrow("expected a file at http://x/a/asset.json, found status 404");
    await expect(loadAsset("http://x/a/", { fetch: serving(200, "<html>") })).rejects.toThrow("expected JSON at http://x/a/asset.json");
  });

  it("names the damaged file", async () => {
    const fetcher = async (url: string) => (url.endsWith("asset.json") ? Response.json(MANIFEST) : new Response("no picture"));
    await expect(loadAsset("http://x/a", { fetch: fetcher })).rejects.toThrow(/cannot read (map_00|r_table).exr/);
  });
});

describe("compressed layers", () => {
  const asset = (encoding: string) => ({ layers: { encoding } }) as unknown as Asset;

  it("are refused by name where the GPU cannot read them", () => {
    expect(() => checkCompression(asset("bc7"), (encoding) => encoding !== "bc7")).toThrow("expected a GPU that reads bc7");
    checkCompression(asset("bc1"), (encoding) => encoding !== "bc7");
    checkCompression(asset("half"), () => false);
  });
});

describe("shader text", () => {
  it("is the pack's, each function once, with the sizes of the asset", () => {
    const asset = { method: methodNamed("relighting-map"), tables: { defines: { SRBF_K: 3 } } } as unknown as Asset;
    const text = shaderText(asset, 2);
    expect(text).toContain("#define SRBF_K 3\n#define SRBF_POINT_LIGHTS 2");
    expect(text.match(/float srbfVersine\(/g)).toHaveLength(1);
    expect(text).not.toMatch(/#include|#version/);
  });
});
