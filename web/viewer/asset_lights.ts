/** Which lights an asset can be relit by, and where those inside its scene may be. */
import { type Asset, lightDomainOf, type Links, type Manifest, type Triple } from "../src";
import { linksOf, within } from "../src/light_linking";
import { ends, heat } from "./direction_widget";
import { areLinks, isPlaced, type LightState, linearColor, namedState, type PlacedState, pointState } from "./light_state";
import { type Profiles, stateOf } from "./keyframes";
import { MOST_LIGHTS } from "./state";
import type { BakedLight } from "./reference";
import type { Bounds } from "./receivers";
import type { Subject } from "./subject";
import { surfaceFacts } from "./surface_state";

const REACH = 0.25; // of the room's radius: where the first light lays an irradiance of 1, so that white walls are not clipped
const OUTSIDE = 0.1; // of the longest side of the box about free places: the page says so of a light farther out
const UNMEASURED = "#9fb2c8";

export type AddedKind = Exclude<LightState["kind"], "named">;

/** Whether lights shine inside the scene. */
export const inside = ({ manifest }: Asset): boolean => ["cloud", "surfels", "pool"].includes(lightDomainOf(manifest));

/** Objects by whose names its lights may choose what they shine on; none where the bake kept none. */
export const linkableOf = ({ tables }: Asset): readonly string[] => tables.gather?.surfels.objects?.names ?? [];

/** Kinds of lights that one can add. */
export function kindsOf(asset: Asset): readonly AddedKind[] {
  if (asset.tables.gather) return ["point", "spot", "sphere", "area", "directional", "environment"];
  if (inside(asset)) return ["point", "spot", "sphere", "area", ...(asset.tables.environment ? (["environment"] as const) : [])];
  return asset.position ? ["directional", "point", "spot", "environment"] : ["directional", "environment"];
}

/** What the panel shows by of an asset. */
export function assetFacts({ asset, maps, hasDirect, sunAngle, profiles }: Subject) {
  return {
    maps: asset.tables.gather ? 0 : maps,
    kinds: kindsOf(asset),
    middle: middleOf(asset),
    hasDirect,
    sunAngle,
    profiles,
    designed: (asset.manifest.scene_lights ?? []).length > 0,
    linkable: linkableOf(asset),
    hasDisc: lightDomainOf(asset.manifest) === "directions",
    ...surfaceFacts(asset),
  };
}

/** The lights that the scene has by itself, all of them, as it has them set. @throws SrbfError on damaged ones. */
export const designedLights = (asset: Asset): LightState[] => designedOf(asset).map(({ name, light }) => ({ ...stateOf(light, `light ${name} of the asset`, "inverse-square", ownProfiles(asset.manifest)), name }) as LightState);

/** The scene's own lights as asset.json has them, which choose among known objects alone: others neither show light nor shadow it. */
export function designedOf(asset: Asset): Designed {
  const known = new Set(linkableOf(asset));
  return (asset.manifest.scene_lights ?? []).map(({ name, light }) => {
    const links = linksOf(light as Links);
    if (!known.size || !areLinks(links)) return { name, light };
    return { name, light: { ...light, ...linksOf({ receivers: links.receivers && within(links.receivers, known), blockers: links.blockers && within(links.blockers, known) }) } };
  });
}

/** @throws SrbfError where a light's links name objects that the asset's scene lacks. */
export function requireObjects({ tables }: Asset, lights: readonly LightState[]): void {
  for (const { links } of lights) if (links) tables.gather?.surfels.objects?.require(links);
}

/** Those of the scene's own lights: IES files. */
const ownProfiles = ({ scene_profiles }: Manifest): Profiles => new Map(Object.keys(scene_profiles ?? {}).map((name) => [name, { projected: false }]));

/** The scene's own lights as asset.json has them. */
export type Designed = readonly { name: string; light: Record<string, unknown> }[];

/** The linear color of a light: that of asset.json where it is as designed, since the page rounds colors to bytes. */
export function exactColor(light: LightState, designed: Designed): Triple {
  const own = light.name === undefined || light.kind === "named" ? undefined : designed.find(({ name }) => name === light.name);
  const before = own && stateOf(own.light, own.name, "inverse-square", new Map([[own.light.profile as string, { projected: false }]]));
  return own && before?.color === light.color && before.intensity === light.intensity ? (own.light.color as Triple) : linearColor(light);
}

/** What the page does not show of the scene's lights and of `lights`, in one line; empty where it shows all of them. */
export function missingLine({ asset, profiles }: Subject, lights: readonly LightState[]): string {
  const { manifest } = asset;
  const shapes = lights.flatMap((light) => ("profile" in light && light.profile !== undefined && !profiles.has(light.profile) ? [light.profile] : []));
  const beyond = (manifest.scene_lights ?? []).slice(MOST_LIGHTS).map(({ name }) => name);
  const linked = linkableOf(asset).length ? [] : lights.flatMap(({ links, name, kind }) => (links ? [name ?? `a ${kind} one`] : []));
  const left = (manifest.scene_lights_left_out ?? []).map(({ name }) => name);
  return [
    beyond.length ? `lights past ${MOST_LIGHTS}: ${beyond.join(", ")}` : "",
    linked.length ? `lights shine without their links to objects: ${linked.join(", ")}` : "",
    left.length ? `lights left out: ${left.join(", ")}` : "",
    shapes.length ? `lights shine without ${[...new Set(shapes)].join(", ")}: give srbf view these files by --profile` : "",
  ]
    .filter(Boolean)
    .join("; ");
}

/** Lights as designed, in place of those of the scene; of the others as many stay as there is room for. */
export function redesign(asset: Asset, state: { lights: LightState[]; selected: number }): void {
  state.lights = [...designedLights(asset), ...state.lights.filter(({ name }) => name === undefined)].slice(0, MOST_LIGHTS);
  state.selected = Math.min(Math.max(state.selected, 0), state.lights.length - 1);
}

/** The scene's own lights, or one inside it; undefined: a sun. */
export function firstLights(asset: Asset, { center, radius }: Bounds): LightState[] | undefined {
  const { names } = asset.tables;
  if (names) return names.map(namedState);
  const designed = designedLights(asset).slice(0, MOST_LIGHTS);
  if (designed.length) return designed;
  return inside(asset) ? [pointState(middleOf(asset) ?? [center[0], center[1], center[2] + 0.5 * radius], REACH * radius)] : undefined;
}

/** The place of free space that is nearest to its middle. */
export function middleOf({ tables: { places = [] } }: Asset): Triple | undefined {
  if (places.length === 0) return undefined;
  const mean = [0, 1, 2].map((k) => places.reduce((sum, place) => sum + place[k], 0) / places.length);
  const away = (place: Triple) => Math.hypot(...place.map((x, k) => x - mean[k]));
  return places.reduce((best, place) => (away(place) < away(best) ? place : best));
}

/** A line on a light that is outside the free places, if there is one. */
export function outsideLine({ tables: { places = [] } }: Asset, lights: readonly LightState[]): string {
  if (places.length === 0) return "";
  const box = (pick: (...values: number[]) => number) => [0, 1, 2].map((k) => places.reduce((end, place) => pick(end, place[k]), places[0][k]));
  const [least, most] = [box(Math.min), box(Math.max)];
  const margin = OUTSIDE * Math.max(...most.map((x, k) => x - least[k]));
  const beyond = (light: PlacedState) => Math.max(...light.position.map((x, k) => Math.max(least[k] - x, x - most[k])));
  const found = lights.findIndex((light) => light.on && isPlaced(light) && beyond(light) > margin);
  if (found < 0) return "";
  return `light ${found + 1} is ${beyond(lights[found] as PlacedState).toPrecision(2)} m outside the space that lights were captured in: its bounces are extrapolated`;
}

/** Where captured lights are inside the scene, in the colors of their errors (dB) once those are known. */
export function capturedPlaces(lights: readonly BakedLight[], errors: readonly number[] | undefined, compared: number) {
  const range = errors && ends(errors);
  return lights.flatMap(({ position }, i) => {
    const good = range && ((errors as number[])[i] - range[0]) / (range[1] - range[0]);
    return position ? [{ position, color: good === undefined ? UNMEASURED : heat(1 - good), marked: i === compared }] : [];
  });
}
