import { readdirSync, readFileSync } from "node:fs";
import { basename, dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { describe, expect, it } from "vitest";
import { directionalLight, environmentLight, inAssetFrame, type Manifest, type Matrix4, METHODS, methodNamed, pointLight } from "../src";

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

  it("are found by name, one shader each", () => {
    for (const method of METHODS) expect(methodNamed(method.name)).toBe(method);
    expect(methodNamed("magic")).toBeUndefined();
    const shaders = readdirSync(join(ROOT, "src/shaders")).map((file) => basename(file, ".glsl"));
    expect(shaders.sort()).toEqual(METHODS.map(({ name }) => name.replaceAll("-", "_")).sort());
    for (const { shader } of METHODS) for (const name of ["srbfSum", "srbfRelit", "srbfRelitSurface"]) expect(shader).toContain(`vec3 ${name}(`);
  });
});

describe("the asset's frame", () => {
  const turn: Matrix4 = [[0, -2, 0, 5], [2, 0, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]; // a quarter turn about z, twice as large
  const asset = { manifest: { domain: "sphere" } as Manifest, assetFromWorld: turn };

  it("takes every kind of light along", () => {
    const environment = environmentLight(4, 2, new Float32Array(24).fill(1));
    const { distant, punctual } = inAssetFrame(asset, [directionalLight([1, 0, 0]), pointLight([1, 0, 0], { a0: 1 }), environment]);
    const [sun, ...texels] = distant;
    expect(sun).toEqual([[0, 1, 0], [1, 1, 1]]);
    expect(punctual).toMatchObject([{ position: [5, 2, 0], a0: 2 }]);
    expect(texels.reduce((total, [, color]) => total + color[0], 0)).toBeCloseTo(4 * Math.PI, 9);
  });
});
