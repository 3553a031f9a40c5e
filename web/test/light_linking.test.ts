import { describe, expect, it } from "vitest";
import { type Asset, directionalLight, environmentLight, IDENTITY, inAssetFrame, type Manifest, pointLight, type Triple } from "../src";
import { isChosen, LinkedObjects } from "../src/light_linking";
import { LinkedLight } from "../src/linked_light";
import { squaredDistance } from "../src/nearest_triangle";
import { Occluders } from "../src/occluders";
import { Cells } from "../src/received_light";
import { placed } from "../src/surfels";
import { designedLights, requireObjects } from "../viewer/asset_lights";
import { blenderRig } from "../viewer/blender_rig";
import { stateOf } from "../viewer/keyframes";
import type { LightState } from "../viewer/light_state";
import { choiceOf, lineOf } from "../viewer/link_controls";

const NAMES = ["Cup", "Floor", "Vase"];
const objects = new LinkedObjects({ names: ["Floor", "Cup"], objects: new Int32Array([0, 1, 1]) }, { names: ["Vase", "Floor"], objects: new Int32Array([0, 1]) });

function random(seed: number): () => number {
  let state = seed;
  return () => (state = (state * 16807) % 2147483647) / 2147483647;
}

describe("a choice of objects", () => {
  it("is all but some, or only some", () => {
    expect(NAMES.map((name) => isChosen({ only: ["Cup", "Vase"], without: ["Vase"] }, name))).toEqual([true, false, false]);
    expect(NAMES.map((name) => isChosen({}, name))).toEqual([true, true, true]);
    expect(NAMES.map((name) => isChosen({ only: [] }, name))).toEqual([false, false, false]);
  });

  it("is made of boxes that are ticked, and told in a line", () => {
    expect(choiceOf(new Set(NAMES), NAMES)).toBeUndefined();
    expect(choiceOf(new Set(["Cup", "Vase"]), NAMES)).toEqual({ without: ["Floor"] });
    expect(choiceOf(new Set(["Cup"]), NAMES)).toEqual({ only: ["Cup"] });
    expect(choiceOf(new Set(), NAMES)).toEqual({ only: [] });
    expect([undefined, { only: [] }, { only: ["Cup"] }, { without: ["Floor"] }, { without: [] }].map((choice) => lineOf(choice, NAMES))).toEqual(["all", "nothing", "Cup", "all but Floor", "all"]);
  });

  it("is of surfels, or of triangles, and the same array again", () => {
    expect(objects.lit({ receivers: { only: ["Cup"] } })).toEqual(new Uint8Array([0, 1, 1]));
    expect(objects.casting({ blockers: { without: ["Vase"] } })).toEqual(new Uint8Array([0, 1]));
    expect(objects.lit({ blockers: { only: [] } })).toBeUndefined();
    expect(objects.lit({ receivers: { only: ["Cup"] } })).toBe(objects.lit({ receivers: { only: ["Cup"] } }));
    expect(() => objects.casting({ blockers: { only: ["Bowl"] } })).toThrow(/among a light's blockers, found "Bowl"; it has "Cup", "Floor", "Vase"/);
  });

  it("is refused by assets that do not know their objects", () => {
    const light = { ...pointLight([0, 0, 1]), receivers: { only: ["Cup"] } };
    const frame = (manifest: object, ...lights: Parameters<typeof inAssetFrame>[1]) => inAssetFrame({ manifest: manifest as Manifest, assetFromWorld: IDENTITY }, lights);
    expect(() => frame({}, light)).toThrow(/without receivers and blockers/);
    expect(() => frame({ light_domain: "pool", gather: {} }, light)).toThrow(/bake again/);
    const known = { light_domain: "pool", gather: { objects: ["Cup"] } };
    const sun = { ...directionalLight([0, 0, 1]), blockers: { only: [] } };
    expect(placed(frame(known, light, sun, environmentLight(1, 1, [1, 1, 1])))).toMatchObject([{ receivers: { only: ["Cup"] } }, { blockers: { only: [] } }, {}]);
  });
});

describe("light on surfels", () => {
  const cells = new Cells({ kind: "float", width: 2, height: 2, channels: 4, data: new Float32Array([0, 0, 0, 1, 3, 0, 0, 1, 0, 0, 1, 0, 0, 0, 1, 1]) }, "pool");
  const roof = new Float32Array([-0.5, -0.5, 1, 0.5, -0.5, 1, 0, 0.5, 1]);
  const own = new LinkedObjects({ names: ["Left", "Right"], objects: new Int32Array([0, 1]) }, { names: ["Roof"], objects: new Int32Array([0]) });
  const received = new LinkedLight({ cells, corners: roof, objects: own, tables: [] });
  const sun = { kind: "directional", direction: [0, 0, 1] as Triple, color: [1, 1, 1] as Triple } as const;
  const reds = (light: Parameters<LinkedLight["under"]>[0]) => [...received.under(light)].filter((_, i) => i % 3 === 0);

  it("is shadowed by what the light chooses, on what it chooses", () => {
    expect(reds(sun)).toEqual([0, 1]);
    expect(reds({ ...sun, blockers: { without: ["Roof"] } })).toEqual([1, 1]);
    expect(reds({ ...sun, blockers: { only: [] }, receivers: { only: ["Left"] } })).toEqual([1, 0]);
    expect(reds({ ...sun, receivers: { without: ["Right"] } })).toEqual([0, 0]);
  });
});

describe("the nearest triangle", () => {
  const next = random(3);
  const corners = Float32Array.from({ length: 9 * 60 }, (_, i) => 4 * (Math.floor(i / 9) % 5) + 2 * next());
  const places = Array.from({ length: 40 }, () => [25 * next() - 2, 25 * next() - 2, 25 * next() - 2] as const);
  const edges = Float64Array.from(corners, (x, i) => (i % 9 < 3 ? x : x - corners[9 * Math.floor(i / 9) + (i % 3)]));

  it("is as far as the nearest of its points", () => {
    const [x, y, z] = [0.3, -0.7, 0.9];
    for (let t = 0; t < 60; ++t) {
      let least = Infinity;
      for (let i = 0; i <= 200; ++i) {
        for (let j = 0; j <= 200 - i; ++j) {
          const [u, v] = [i / 200, j / 200];
          const off = (k: number) => edges[9 * t + k] + u * edges[9 * t + 3 + k] + v * edges[9 * t + 6 + k];
          least = Math.min(least, (off(0) - x) ** 2 + (off(1) - y) ** 2 + (off(2) - z) ** 2);
        }
      }
      const found = squaredDistance(edges, 9 * t, x, y, z);
      expect(found).toBeLessThanOrEqual(least + 1e-9);
      expect(Math.sqrt(found)).toBeGreaterThan(Math.sqrt(least) - 0.03); // of a grid's steps
    }
  });

  it("is that of all", () => {
    const occluders = new Occluders(corners);
    for (const [x, y, z] of places) {
      const all = Array.from({ length: 60 }, (_, t) => squaredDistance(edges, 9 * t, x, y, z));
      expect(all[occluders.nearest(x, y, z)]).toBe(Math.min(...all));
    }
    expect(new Occluders(new Float32Array()).nearest(0, 0, 0)).toBe(-1);
  });
});

describe("lights as designed", () => {
  const light = { kind: "point", position: [0, 0, 1], receivers: { only: ["Near", "Cable"] }, blockers: { without: ["Cable"] } };
  const asset = { manifest: { scene_lights: [{ name: "Key", light }] }, tables: { gather: { surfels: { objects: new LinkedObjects({ names: ["Near", "Far"], objects: Int32Array.of(0, 1) }, { names: ["Far"], objects: Int32Array.of(0) }) } } } } as unknown as Asset;

  it("choose among objects that the asset knows", () => {
    const [key] = designedLights(asset);
    expect(key.links).toEqual({ receivers: { only: ["Near"] }, blockers: { without: [] } });
    expect(() => requireObjects(asset, [key])).not.toThrow();
    expect(() => requireObjects(asset, [{ ...key, links: light } as LightState])).toThrow(/Cable/);
  });

  it("are as designed for Blender whatever the order of names", () => {
    const designed = [{ name: "Key", light: { kind: "point", position: [0, 0, 1], color: [1, 1, 1], receivers: { only: ["Far", "Near"] } } }];
    const told = (only: string[]) => JSON.parse(/LIGHTS = json.loads\(r"""(.*?)"""\)/s.exec(blenderRig([{ ...designedLights(asset)[0], links: { receivers: { only } } }] as LightState[], 0, designed))?.[1] ?? "");
    expect(told(["Near", "Far"])[0].changed).toBe(false);
    expect(told(["Near"])[0].changed).toBe(true);
  });

  it("belong to lights that may choose", () => {
    const links = { receivers: { only: ["Near"] } };
    const stored = [{ kind: "environment", file: "room.hdr" }, { kind: "named", name: "Key" }];
    for (const entry of stored) expect(() => stateOf({ ...entry, ...links }, "frame 0", "linear")).toThrow(/expected suns and lights of a place/);
    expect(stateOf({ kind: "directional", direction: [0, 0, 1], ...links }, "frame 0", "linear").links).toEqual(links);
  });
});
