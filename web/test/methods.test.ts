import { readdirSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { describe, expect, it } from "vitest";
import {
  asDesigned,
  type Asset,
  directionalLight,
  environmentLight,
  IDENTITY,
  inAssetFrame,
  type Light,
  type Manifest,
  type Matrix4,
  METHODS,
  methodNamed,
  namedLight,
  pointLight,
  setNamedLight,
} from "../src";

const ROOT = join(dirname(fileURLToPath(import.meta.url)), "..");

function sources(folder: string): string[] {
  const entries = readdirSync(join(ROOT, folder), { withFileTypes: true });
  return entries.flatMap((entry) => (entry.isDirectory() ? sources(`${folder}/${entry.name}`) : entry.name.endsWith(".ts") ? [`${folder}/${entry.name}`] : []));
}

describe("methods", () => {
  it.each(METHODS.map(({ name }) => [name]))("%s is named in its own file alone", (name) => {
    const files = [...sources("src"), ...sources("viewer")].filter((file) => new RegExp(`["'\`]${name}["'\`]`).test(readFileSync(join(ROOT, file), "utf8")));
    expect(files).toEqual([`src/methods/${name.replaceAll("-", "_")}.ts`]);
  });

  it("are found by name, each with a shader, and there are no other shaders", () => {
    for (const method of METHODS) expect(methodNamed(method.name)).toBe(method);
    expect(methodNamed("magic")).toBeUndefined();
    const imported = sources("src").flatMap((file) => [...readFileSync(join(ROOT, file), "utf8").matchAll(/shaders\/(\w+\.glsl)"/g)].map(([, name]) => name));
    const shaders = readdirSync(join(ROOT, "src/shaders"));
    const included = shaders.flatMap((file) => [...readFileSync(join(ROOT, "src/shaders", file), "utf8").matchAll(/#include "(\w+\.glsl)"/g)].map(([, name]) => name));
    expect(shaders.sort()).toEqual([...new Set([...imported, ...included])].sort());
    for (const { shader } of METHODS) for (const name of ["srbfSum", "srbfRelit", "srbfRelitSurface"]) expect(shader).toContain(`vec3 ${name}(`);
  });
});

describe("named lights", () => {
  const asset = { tables: { names: ["Window", "TV"] } } as unknown as Asset;

  it("are as designed until they are set, each once", () => {
    const lights: Light[] = asDesigned(asset);
    setNamedLight(asset, lights, "TV", 0.5, [1, 0.5, 2]);
    setNamedLight(asset, lights, "TV", 2, [1, 0.5, 2]);
    expect(lights).toEqual([namedLight("Window", [1, 1, 1]), namedLight("TV", [2, 1, 4])]);
  });

  it("are refused by unknown names and by assets without any", () => {
    expect(() => setNamedLight(asset, [], "tv")).toThrow('expected a light of "Window", "TV", found "tv"');
    expect(() => setNamedLight({ tables: {} } as Asset, [], "TV")).toThrow('expected an asset of named lights for "TV"');
    expect(() => setNamedLight(asset, [], "TV", Number.NaN)).toThrow("expected color as three finite numbers");
    const manifest = (light_domain?: "named") => ({ manifest: { domain: "sphere", light_domain } as Manifest, assetFromWorld: IDENTITY });
    expect(() => inAssetFrame(manifest("named"), [pointLight([0, 0, 1])])).toThrow("expected lights of named for this asset, found a point one");
    expect(() => inAssetFrame(manifest(), [namedLight("TV")])).toThrow("found a named one");
  });
});

describe("the asset's frame", () => {
  const turn: Matrix4 = [[0, -2, 0, 5], [2, 0, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]; // a quarter turn about z, twice as large
  const asset = { manifest: { domain: "sphere" } as Manifest, assetFromWorld: turn };

  it("takes every kind of light along", () => {
    const environment = environmentLight(4, 2, new Float32Array(24).fill(1));
    const { distant, environments, punctual } = inAssetFrame(asset, [directionalLight([1, 0, 0]), pointLight([1, 0, 0], { a0: 1 }), environment]);
    expect(distant).toEqual([[[0, 1, 0], [1, 1, 1]]]);
    expect(environments).toEqual([environment]);
    expect(punctual).toMatchObject([{ position: [5, 2, 0], a0: 2 }]);
  });
});
