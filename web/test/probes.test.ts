import { describe, expect, it } from "vitest";
import type { AssetFiles } from "../src/files";
import type { Manifest } from "../src/manifest";
import { facetNormals, harmonicsAt, harmonicWeights, readProbes } from "../src/probes";

const receiver = { kind: "probes", origin: [0, 0, 0], spacing: 0.5, counts: [2, 3, 1], places: "probes.exr", nearness: "probe_nearness.exr" };
const read = (changed: object, size = {}) => readProbes({} as AssetFiles, { width: 24, height: 3, ...size, receiver: { ...receiver, ...changed } } as unknown as Manifest);

describe("probes", () => {
  it("are read of their receivers alone", async () => {
    expect(await read({ kind: "lightmap" })).toBeUndefined();
    await expect(read({ counts: [2, 0, 1] })).rejects.toThrow("expected origin, spacing, counts, places and nearness of probes in asset.json");
    await expect(read({ spacing: "wide" })).rejects.toThrow("expected origin, spacing, counts");
    await expect(read({}, { width: 25 })).rejects.toThrow("expected 24x3 texels in asset.json, found 25x3");
  });

  it("have harmonics that give back the irradiance on their facets", () => {
    const lobe = [1, 2 / 3, 1 / 4].map((part) => Math.PI * part);
    const radiance = Array.from({ length: 9 }, (_, k) => Math.sin(k + 1));
    const irradiance = facetNormals().map((normal) => harmonicsAt(normal).reduce((sum, y, k) => sum + lobe[Math.floor(Math.sqrt(k))] * y * radiance[k], 0));
    const found = radiance.map((_, k) => harmonicWeights().reduce((sum, weights, f) => sum + weights[k] * irradiance[f], 0));
    found.forEach((value, k) => expect(value).toBeCloseTo(radiance[k], 12));
  });
});
