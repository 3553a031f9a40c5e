import { describe, expect, it } from "vitest";
import { environmentLight, IDENTITY, type Matrix4, type Triple } from "../src";
import { environmentSamples, reduced } from "../src/environment";
import { cellRadiance } from "../src/environment_table";
import { GaussianSums } from "../src/environment_sums";

const QUARTER: Matrix4 = [[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];
const TWICE_TIPPED: Matrix4 = [[2, 0, 0, 1], [0, 1.2, -1.6, 0], [0, 1.6, 1.2, 0], [0, 0, 0, 1]];

const random = (seed: number) => () => (seed = (seed * 16807) % 2147483647) / 2147483647;

/** A golden spiral, and both poles. */
const spiral = (count: number): Triple[] =>
  Array.from({ length: count }, (_, i) => {
    const z = i === 0 ? 1 : i === count - 1 ? -1 : 1 - (2 * i + 1) / count;
    const r = Math.sqrt(1 - z * z);
    return [r * Math.cos(2.4 * i), r * Math.sin(2.4 * i), z];
  });

/** Noise, with a sun of one texel. */
function noise(width: number, height: number, sun: number): Float32Array {
  const next = random(7);
  const pixels = Float32Array.from({ length: 3 * width * height }, next);
  pixels.fill(2000, 3 * sun, 3 * sun + 3);
  return pixels;
}

const COUNT = 400;

/** The exact sums over all texels at some of the centers, and those that are found there. */
function both(region: "sphere" | "hemisphere", spread: number, frame: Matrix4, turn: number): [Float64Array, Float64Array] {
  const [width, height] = [160, 80];
  const centers = spiral(COUNT);
  const some = centers.filter((_, i) => i % 30 === 0 || i === COUNT - 1);
  const light = environmentLight(width, height, noise(width, height, 40 * width + 33), [1, 2, 0.5], turn);
  const [exact, found] = [new Float64Array(3 * some.length), new Float64Array(3 * COUNT)];
  new GaussianSums(some, spread, region).addDistant(environmentSamples(light, region, frame), exact);
  new GaussianSums(centers, spread, region).addEnvironment(light, frame, found);
  return [exact, Float64Array.from(exact, (_, i) => found[3 * centers.indexOf(some[Math.floor(i / 3)]) + (i % 3)])];
}

describe("a reduced environment map", () => {
  it("has the light of the whole one", () => {
    const light = environmentLight(180, 90, noise(180, 90, 4000), [1, 1, 1]);
    const small = reduced(light, 25);
    expect([small.width, small.height]).toEqual([60, 30]);
    const total = (map: typeof light) => [...environmentSamples(map, "sphere", IDENTITY)].reduce((sum, [, [r]]) => sum + r, 0);
    expect(total(small)).toBeCloseTo(total(light), 6);
    const smooth = environmentLight(180, 90, Float32Array.from({ length: 3 * 180 * 90 }, (_, i) => 1 + Math.sin(i / 3 / 180 / 15)));
    const [cells, expected] = [reduced(smooth, 30), smooth].map((map) => cellRadiance(map, 3, IDENTITY));
    cells.forEach((value, i) => expect(Math.abs(value - expected[i])).toBeLessThan(0.03));
  });

  it("stays where its sides cannot be divided", () => {
    const light = environmentLight(202, 101, noise(202, 101, 7));
    expect(reduced(light, 30)).toBe(light);
    expect(reduced(light, 101)).toBe(light);
  });
});

describe("an environment map of many texels", () => {
  it.each([
    ["sphere", 0.15, IDENTITY, 0],
    ["sphere", 0.15, TWICE_TIPPED, 1],
    ["sphere", 0.4, QUARTER, -2.5],
    ["hemisphere", 0.15, QUARTER, 0.3],
    ["hemisphere", 0.15, TWICE_TIPPED, 0.3],
  ] as const)("has the sums of its texels on the %s, of spread %s", (region, spread, frame, turn) => {
    const [exact, found] = both(region, spread, frame, turn);
    const most = exact.reduce((a, b) => Math.max(a, b), 0);
    const worst = exact.reduce((a, value, i) => Math.max(a, Math.abs(value - found[i])), 0);
    expect(worst).toBeLessThan(5e-3 * most);
    expect(Math.sqrt(exact.reduce((a, value, i) => a + (value - found[i]) ** 2, 0) / exact.reduce((a, value) => a + value ** 2, 0))).toBeLessThan(1e-3);
  });

  it("turns as its centers turn back", () => {
    const light = environmentLight(160, 80, noise(160, 80, 5000), [1, 1, 1], Math.PI / 2);
    const centers = spiral(COUNT);
    const [turned, still] = [new Float64Array(3 * COUNT), new Float64Array(3 * COUNT)];
    new GaussianSums(centers, 0.1, "sphere").addEnvironment(light, IDENTITY, turned);
    new GaussianSums(centers.map(([x, y, z]): Triple => [y, -x, z]), 0.1, "sphere").addEnvironment({ ...light, turn: 0 }, IDENTITY, still);
    turned.forEach((value, i) => expect(value).toBeCloseTo(still[i], 4));
  });
});
