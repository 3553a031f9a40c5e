/** FRAMES.json played by the page: the lights of one frame after the other, as `srbf relight --lights` reads them. */
import { DEFAULT_RADIUS, unit } from "../src/lights";
import { cross, dot } from "../src/matrix";
import { type Links, SrbfError, type Triple } from "../src";
import { isLinkable, isLinked, linksOf } from "../src/light_linking";
import { areLinks, levelSides, type LightState, round, rounded } from "./light_state";
import { MOST_LIGHTS, type State } from "./state";

export const FRAMES_PER_SECOND = 24;
const NONE: Profiles = new Map();

type Entry = Record<string, unknown>;
/** Profiles that lights may have, by name: IES files, or images for spots to project. */
export type Profiles = ReadonlyMap<string, { readonly projected: boolean }>;

/**
 * Frames of a file's text; `usual`: the falloff of point lights that do not say; `profiles`: those that they may have. @throws SrbfError in one line on
 * anything else.
 */
export function readFrames(text: string, name: string, usual: "linear" | "inverse-square" = "linear", profiles = NONE): LightState[][] {
  let json: { frames?: { lights?: Entry[] }[] };
  try {
    json = JSON.parse(text);
  } catch {
    throw new SrbfError(`expected JSON in ${name}, found something else; srbf/schemas/frames.schema.json says what it holds`);
  }
  const frames = json?.frames;
  if (!Array.isArray(frames) || frames.length === 0) throw new SrbfError(`expected a list of frames in ${name}, found none`);
  return frames.map((frame, i) => {
    if (!Array.isArray(frame?.lights)) throw new SrbfError(`expected lights in frame ${i} of ${name}, found none`);
    return frame.lights.map((light) => stateOf(light, `frame ${i} of ${name}`, usual, profiles));
  });
}

/** Plays the frames of a file, once in each period. */
export class Keyframes {
  private turns = 0;

  constructor(
    readonly frames: readonly (readonly LightState[])[],
    private readonly state: State,
  ) {
    const named = state.lights.some(({ kind }) => kind === "named");
    const known = new Set(state.lights.map((light) => (light.kind === "named" ? light.name : "")));
    for (const light of frames.flat()) {
      if ((light.kind === "named") !== named) throw new SrbfError(`expected ${named ? "named" : "no named"} lights for this asset, found a ${light.kind} one in the frames`);
      if (light.kind === "named" && !known.has(light.name)) throw new SrbfError(`expected a light of this asset, found ${JSON.stringify(light.name)} in the frames`);
    }
    const most = Math.max(...frames.map(({ length }) => length));
    if (!named && most > MOST_LIGHTS) throw new SrbfError(`expected at most ${MOST_LIGHTS} lights in a frame, found ${most}`);
  }

  /** Go on by `seconds`; whether the lights that exist have changed, rather than their numbers. */
  advance(seconds: number): boolean {
    const before = this.turns;
    this.turns = (this.turns + Math.min(seconds, 0.25) / this.state.seconds) % 1;
    return this.show(Math.floor(before * this.frames.length));
  }

  /** Set the state's lights to those of a frame. Named lights that it does not list are off. */
  show(index: number): boolean {
    const frame = this.frames[Math.min(index, this.frames.length - 1)];
    const { lights } = this.state;
    if (lights.some(({ kind }) => kind === "named")) {
      const listed = new Map(frame.map((light) => [light.kind === "named" ? light.name : "", light]));
      for (const light of lights) {
        const found = light.kind === "named" ? listed.get(light.name) : undefined;
        if (found) Object.assign(light, found);
        else light.on = false;
      }
      return false;
    }
    const others = frame.length !== lights.length || frame.some((light, i) => light.kind !== lights[i].kind || profileOf(light) !== profileOf(lights[i]) || JSON.stringify(light.links) !== JSON.stringify(lights[i].links));
    if (others) lights.splice(0, lights.length, ...frame.map((light, i) => ({ ...structuredClone(light), solo: lights[i]?.solo })));
    else frame.forEach((light, i) => assignLight(lights[i], structuredClone(light)));
    this.state.selected = Math.min(this.state.selected, lights.length - 1);
    return others;
  }
}

const profileOf = (light: LightState) => ("profile" in light ? light.profile : undefined);

/** Give a light, which controls hold, all that another one has; whether it shines alone stays. */
function assignLight(light: LightState, other: LightState): void {
  const own = light as unknown as Record<string, unknown>;
  for (const key of Object.keys(own)) if (key !== "solo" && !(key in other)) delete own[key];
  Object.assign(light, other);
}

/** The state of a light of FRAMES.json, whose profile is one of `profiles`. @throws SrbfError that names `where`. */
export function stateOf(entry: Entry, where: string, usual: "linear" | "inverse-square", profiles = NONE): LightState {
  const bad = (expected: string, found: unknown): never => {
    throw new SrbfError(`expected ${expected} in ${where}, found ${JSON.stringify(found) ?? "none"}`);
  };
  const triple = (key: string, otherwise?: Triple): Triple => {
    const value = entry[key] ?? otherwise;
    if (!Array.isArray(value) || value.length !== 3 || !value.every(Number.isFinite)) bad(`three numbers of ${key}`, value);
    return value as unknown as Triple;
  };
  const number = (key: string, otherwise: number) => {
    const value = entry[key] ?? otherwise;
    if (!Number.isFinite(value)) bad(`a number of ${key}`, value);
    return value as number;
  };
  const degrees = (key: string) => round((number(key, 0) * 180) / Math.PI);
  if (entry.size !== undefined && !(number("size", 0) >= 0)) bad("a size of 0 or more", entry.size);
  if (entry.angle !== undefined && !(degrees("angle") >= 0 && degrees("angle") < 180)) bad("an angle of 0 to pi", entry.angle);
  const profile = profiles.get(entry.profile as string);
  if (entry.profile !== undefined && !profile) bad(profiles.size ? `a profile of ${[...profiles.keys()].join(", ")}` : "lights without a profile, since this asset has none,", entry.profile);
  if (profile?.projected && !(entry.kind === "spot" && number("outer", Infinity) < Math.PI / 2)) bad("a spot of an outer half-angle below pi / 2 to project an image", entry.kind);
  const color = triple("color", [1, 1, 1]);
  if (color.some((x) => x < 0)) bad("colors of 0 or more", color);
  const intensity = entry.kind === "named" ? number("intensity", 1) : 1;
  if (intensity < 0) bad("an intensity of 0 or more", intensity);
  const own = typeof entry.name === "string" && entry.kind !== "named" ? { name: entry.name } : {};
  const links = linksOf(entry as Links);
  if (!areLinks(links)) bad("receivers and blockers as {only, without} of names", links);
  if (isLinked(links) && !isLinkable(entry.kind)) bad("suns and lights of a place with receivers and blockers", entry.kind);
  const common = { on: true, ...own, ...(isLinked(links) ? { links } : {}), ...colored([color[0] * intensity, color[1] * intensity, color[2] * intensity]) };
  if (entry.kind === "named") return { kind: "named", ...common, name: typeof entry.name === "string" ? entry.name : bad("a name", entry.name) };
  if (entry.kind === "directional") return { kind: "directional", ...common, direction: rounded(triple("direction")), ...(entry.angle === undefined ? {} : { angle: degrees("angle") }) };
  if (entry.kind === "environment") return { kind: "environment", ...common, file: typeof entry.file === "string" ? entry.file : bad("a file", entry.file), ...(entry.turn === undefined ? {} : { turn: degrees("turn") }) };
  if (entry.kind === "area") return areaOf(triple("position"), triple("u"), triple("v"), round(number("a0", 1)), common);
  if (entry.kind !== "point" && entry.kind !== "spot" && entry.kind !== "sphere") return bad("lights of named, directional, point, spot, sphere, area, environment", entry.kind);
  const falloff = (entry.falloff ?? usual) === "inverse-square" ? "inverse-square" : "linear";
  const position = triple("position");
  const axis = triple("direction", entry.kind === "spot" ? undefined : [0, 0, -1]);
  const shape = entry.profile === undefined ? {} : { profile: entry.profile as string, roll: degrees("roll"), ...(entry.kind === "spot" ? {} : { direction: rounded(axis) }) };
  const point = { ...common, position: rounded(position), a0: round(number("a0", 1)), falloff, radius: round(number("radius", DEFAULT_RADIUS)), ...shape } as const;
  if (entry.kind === "point") return { kind: "point", ...point };
  if (entry.kind === "sphere") return { kind: "sphere", ...point, size: round(number("size", 0.05)) };
  const target = rounded([position[0] + axis[0], position[1] + axis[1], position[2] + axis[2]]);
  return { kind: "spot", ...point, target, inner: degrees("inner"), outer: degrees("outer"), ...(entry.size === undefined ? {} : { size: round(number("size", 0)) }) };
}

function areaOf(position: Triple, u: Triple, v: Triple, a0: number, common: { on: boolean; color: string; intensity: number }): LightState {
  const facing = unit(cross(u, v));
  const [level, other] = levelSides(facing);
  const turn = round((Math.atan2(dot(u, other), dot(u, level)) * 180) / Math.PI);
  const target = rounded([position[0] + facing[0], position[1] + facing[1], position[2] + facing[2]]);
  return { kind: "area", ...common, position: rounded(position), target, width: round(Math.hypot(...u)), height: round(Math.hypot(...v)), turn, a0 };
}

/** A linear color as the page holds it: its largest component, and the rest as sRGB #rrggbb [IEC61966]. */
function colored(color: Triple): { color: string; intensity: number } {
  const most = Math.max(...color);
  if (most === 0) return { color: "#ffffff", intensity: 0 };
  const byte = (x: number) => Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
  return { color: `#${color.map((x) => byte(x / most).toString(16).padStart(2, "0")).join("")}`, intensity: round(most) };
}
