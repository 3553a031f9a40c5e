/** The moving sphere as the page and its URL hold it, and where it may be. */
import { type Asset, SrbfError, type Triple } from "../src";
import { carried } from "../src/matrix";
import { probesOf } from "../src/probes";
import { round, rounded } from "./light_state";
import { inverse } from "./receivers";

const FIRST_HEIGHT = 0.35; // of the probes' box
const APART = 3; // sizes from the light that there is at first
const SIZE = 0.05; // of the receivers' radius

/** In the asset's world, m; `size` is a radius. */
export interface BallState {
  on: boolean;
  position: Triple;
  size: number;
}

/** A box in the asset's world. */
export interface Box {
  least: Triple;
  most: Triple;
}

/** Of those that have a light of their own, in the asset's world. */
function places(asset: Asset): Triple[] {
  const { data } = probesOf(asset).places;
  const worldFromAsset = inverse(asset.assetFromWorld);
  const own = Array.from({ length: data.length / 4 }, (_, i) => i).filter((i) => Math.round(data[4 * i + 3]) === i);
  return own.map((i) => carried(worldFromAsset, [data[4 * i], data[4 * i + 1], data[4 * i + 2]]));
}

/** The box about all probes. */
export function roomOf(asset: Asset): Box {
  const ends = (pick: (...values: number[]) => number, first: number) => [0, 1, 2].map((k) => places(asset).reduce((end, place) => pick(end, place[k]), first)) as unknown as Triple;
  return { least: ends(Math.min, Infinity), most: ends(Math.max, -Infinity) };
}

/** At a probe near the middle, some way from `light`. */
export function firstBall(asset: Asset, light: Triple | undefined, radius: number): BallState {
  const { least, most } = roomOf(asset);
  const size = round(SIZE * radius);
  const middle = least.map((low, k) => low + (k === 2 ? FIRST_HEIGHT : 0.5) * (most[k] - low));
  const from = (point: readonly number[]) => (place: Triple) => Math.hypot(...place.map((x, k) => x - point[k]));
  const away = from(middle);
  const all = places(asset);
  const clear = light ? all.filter((place) => from(light)(place) > APART * size) : all;
  return { on: true, position: rounded((clear.length ? clear : all).reduce((best, place) => (away(place) < away(best) ? place : best))), size };
}

/** `value` as a sphere's state. @throws SrbfError on anything else. */
export function checkBall(value: unknown): BallState {
  const { on, position, size } = (value ?? {}) as Partial<BallState>;
  const placed = Array.isArray(position) && position.length === 3 && position.every((x) => Number.isFinite(x));
  if (typeof on !== "boolean" || !placed || !(Number.isFinite(size) && (size as number) > 0)) {
    throw new SrbfError(`expected a sphere with a position and a size in the page's address, found ${JSON.stringify(value)}; the page uses its defaults`);
  }
  return value as BallState;
}
