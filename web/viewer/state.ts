/** The page's state, and its URL: `#` followed by the state as JSON. */
import { SrbfError, type Triple } from "../src";
import { checkLight, directionalState, isDesigned, type LightState, round, rounded } from "./light_state";
import { type BallState, checkBall } from "./ball_state";
import { checkSurfaces, type SurfaceState } from "./surface_state";

export const TONES = ["linear", "agx", "aces"] as const;
export const SHOWS = ["picture", "false color", "negative", "map"] as const;
export const COMPARES = ["off", "slider", "difference", "reference"] as const;
export const PATHS = ["none", "turn", "swing", "frames"] as const;
export const TERMS = ["both", "direct", "indirect"] as const;
export const VIEWS = ["scene", "mesh", "texels"] as const;

export interface State {
  /** Index of the asset. */
  asset: number;
  lights: LightState[];
  /** Index of the light that the controls edit. */
  selected: number;
  /** Objects that emit or are repainted, and the one that the controls edit. */
  surfaces: SurfaceState[];
  surface: string;
  /** Stops. */
  exposure: number;
  tone: (typeof TONES)[number];
  show: (typeof SHOWS)[number];
  /** Which coefficient map `map` shows. */
  map: number;
  /** Which light of an indirect asset is shown: indirect, direct, or both. */
  terms: (typeof TERMS)[number];
  /** Whether every baked light's error is shown at its direction, and whether the spectrum is drawn. */
  errors: boolean;
  spectrum: boolean;
  compare: (typeof COMPARES)[number];
  /** Position of the slider, as a fraction of the picture's width. */
  split: number;
  /** The lit mesh in its scene, the mesh alone, or the lightmap's texels as a picture. */
  view: (typeof VIEWS)[number];
  /** Whether surfaces are hidden that are seen from behind: a room's walls between the eye and what is inside. */
  cut: boolean;
  /** The orbit camera's position and target, in the asset's world. */
  eye?: [Triple, Triple];
  /** Of pictures: screen pixels per texel, 0 to fit the window; and the texel in the middle. */
  zoom: number;
  middle: [number, number];
  path: (typeof PATHS)[number];
  /** Period of the path, seconds. */
  seconds: number;
  playing: boolean;
  /** Whether the camera orbits while the path plays, with twice its period. */
  turntable: boolean;
  /** The sphere that probes light; undefined without probes. */
  ball?: BallState;
}

/** What the page shows of an asset at first; `own`: lights that it has in place of a sun. */
export function firstState(
  { quantity, width, height, scene_lights }: { quantity: "irradiance" | "radiance"; width: number; height: number; scene_lights?: readonly unknown[] },
  view: State["view"],
  own: LightState[] = [directionalState(rounded([-0.45, -0.5, 0.74]))],
): State {
  return {
    asset: 0,
    lights: own,
    selected: 0,
    surfaces: [],
    surface: "",
    exposure: (quantity === "radiance" || view === "scene") && !scene_lights?.length ? 1.65 : 0, // the scene's own lights: as in Blender
    tone: "linear",
    show: "picture",
    map: 0,
    terms: "both",
    errors: false,
    spectrum: false,
    compare: "off",
    split: 0.5,
    view,
    cut: own.some(({ kind }) => kind !== "directional"),
    zoom: 0,
    middle: [width / 2, height / 2],
    path: "none",
    seconds: 8,
    playing: false,
    turntable: false,
  };
}

/** Called with what changed of a state: `lights` when they must be relit, `panel` when controls must be redrawn. */
export type Changed = (what?: { lights?: boolean; panel?: boolean }) => void;

/** The path that playing starts where none was chosen. */
export const firstPath = ({ lights }: State): State["path"] => (lights.some(({ kind }) => kind === "named") ? "frames" : "turn");

/** Named lights that are as designed are left out. */
export function encodeState(state: State): string {
  const lights = state.lights.filter((light) => light.kind !== "named" || !isDesigned(light));
  const rounding = (_: string, value: unknown) => (typeof value === "number" ? round(value) : value);
  return `#${encodeURIComponent(JSON.stringify({ ...state, lights }, rounding)).replaceAll("'", "%27").replace(/%(2C|3A|7B|7D|5B|5D|22)/g, (c) => (c === "%22" ? "'" : decodeURIComponent(c)))}`;
}

/** The state in `hash`, with defaults from `plain`. @throws SrbfError in one line where it holds none. */
export function decodeState(hash: string, plain: State): State {
  if (hash.length < 2) return plain;
  let given: Partial<State>;
  try {
    given = JSON.parse(decodeURIComponent(hash.slice(1).replaceAll("'", "%22")));
  } catch {
    throw new SrbfError("expected a state that this page wrote in its address, found something else; the page uses its defaults");
  }
  const state: State = { ...plain };
  const one = <K extends keyof State>(key: K, fits: (value: never) => boolean) => {
    const value = given[key];
    if (value === undefined) return;
    if (!fits(value as never)) throw new SrbfError(`expected another ${key} in the page's address, found ${JSON.stringify(value)}; the page uses its defaults`);
    state[key] = value as State[K];
  };
  const number = (least: number, most: number) => (value: number) => typeof value === "number" && value >= least && value <= most;
  const choice = (names: readonly string[]) => (value: string) => names.includes(value);
  const triple = (v: unknown) => Array.isArray(v) && v.length === 3 && v.every((x) => Number.isFinite(x));
  one("exposure", number(-20, 20));
  one("tone", choice(TONES));
  one("show", choice(SHOWS));
  one("map", (value: number) => Number.isInteger(value) && value >= 0);
  one("compare", choice(COMPARES));
  one("split", number(0, 1));
  one("view", choice(VIEWS));
  one("asset", (value: number) => Number.isInteger(value) && value >= 0);
  one("terms", choice(TERMS));
  for (const key of ["errors", "spectrum", "turntable", "cut"] as const) one(key, (value: unknown) => typeof value === "boolean");
  one("eye", (value: unknown[]) => Array.isArray(value) && value.length === 2 && value.every(triple));
  one("zoom", number(0, 1e3));
  one("middle", (value: number[]) => Array.isArray(value) && value.length === 2 && value.every((x) => Number.isFinite(x)));
  one("path", choice(PATHS));
  one("seconds", number(0.1, 1e4));
  one("playing", (value: unknown) => typeof value === "boolean");
  if (given.lights !== undefined) {
    const most = Math.max(MOST_LIGHTS, plain.lights.length);
    if (!Array.isArray(given.lights) || given.lights.length > most) throw new SrbfError("expected a list of lights in the page's address; the page uses its defaults");
    state.lights = fitting(given.lights.map(checkLight), plain.lights);
  }
  if (given.surfaces !== undefined) state.surfaces = checkSurfaces(given.surfaces);
  if (given.ball !== undefined && plain.ball !== undefined) state.ball = checkBall(given.ball);
  one("surface", (value: unknown) => typeof value === "string");
  one("selected", number(-1, state.lights.length - 1));
  state.selected = Math.min(state.selected, state.lights.length - 1);
  return state;
}

/** `given` in place of the asset's own lights of the same names, or of all where it has no named ones. @throws SrbfError on lights of the other sort. */
function fitting(given: LightState[], own: readonly LightState[]): LightState[] {
  const named = own.some(({ kind }) => kind === "named");
  const wrong = given.find((light) => (light.kind === "named") !== named || (light.kind === "named" && !own.some((one) => one.kind === "named" && one.name === light.name)));
  if (wrong) {
    const found = wrong.kind === "named" ? JSON.stringify(wrong.name) : `a ${wrong.kind} one`;
    throw new SrbfError(`expected a light of this asset in the page's address, found ${found}; the page uses its defaults`);
  }
  if (!named) return given;
  const changed = new Map(given.map((light) => [light.kind === "named" ? light.name : "", light]));
  return own.map((light) => (light.kind === "named" && changed.get(light.name)) || light);
}

export const MOST_LIGHTS = 16;
