/** A light's place along its path: a turn about the vertical, or a swing over the zenith and back; an environment turns half around and back. */
import type { Triple } from "../src";
import { type LightState, round, rounded } from "./light_state";
import type { Bounds } from "./receivers";
import type { State } from "./state";

/** An angle from -180 to 180 degrees. */
const around = (degrees: number) => degrees - 360 * Math.round(degrees / 360);

const WIDEST = (75 * Math.PI) / 180; // of a swing, off the zenith

/** `light` after `turns` rounds of `path`; point lights turn about `center`, and swing along x by the scene's `radius`. */
export function along(light: LightState, path: State["path"], turns: number, center: Triple, radius: number): LightState {
  const angle = 2 * Math.PI * turns;
  if (path === "none" || path === "frames" || light.kind === "named") return light;
  if (light.kind === "environment") return { ...light, turn: round(around((light.turn ?? 0) + 360 * (path === "turn" ? turns : 0.5 * Math.sin(angle)))) };
  if (light.kind === "directional") {
    return { ...light, direction: rounded(path === "turn" ? turned(light.direction, angle) : swung(light.direction, angle)) };
  }
  if (path === "turn") {
    const from: Triple = [light.position[0] - center[0], light.position[1] - center[1], light.position[2]];
    const [x, y, z] = turned(from, angle);
    return { ...light, position: rounded([x + center[0], y + center[1], z]) };
  }
  return { ...light, position: rounded([light.position[0] + 0.5 * radius * Math.sin(angle), light.position[1], light.position[2]]) };
}

/** Moves the selected light along the path while the page plays. */
export class Playback {
  private base?: { light: LightState; copy: LightState; turns: number };

  constructor(
    private readonly state: State,
    private readonly bounds: Bounds,
  ) {}

  /** Start from the light's current place the next time. */
  stop(): void {
    this.base = undefined;
  }

  /** Advance by `seconds`; false where no light is selected. */
  advance(seconds: number): boolean {
    const light = this.state.lights[this.state.selected];
    if (!light) return false;
    if (this.base?.light !== light) this.base = { light, copy: structuredClone(light), turns: 0 };
    this.base.turns += Math.min(seconds, 0.25) / this.state.seconds;
    Object.assign(light, this.moved(this.base.copy, this.base.turns));
    return true;
  }

  /** One round of the path, as frames. */
  frames(perSecond: number): LightState[][] {
    const { lights, selected, seconds } = this.state;
    const count = Math.max(1, Math.round(seconds * perSecond));
    return Array.from({ length: count }, (_, i) => lights.map((light, j) => (j === selected ? this.moved(light, i / count) : light)));
  }

  /** `light` after `turns` rounds of the path. */
  private moved(light: LightState, turns: number): LightState {
    const { center, radius } = this.bounds;
    return along(light, this.state.path === "none" ? "turn" : this.state.path, turns, center, radius);
  }
}

function turned([x, y, z]: Triple, angle: number): Triple {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return [c * x - s * y, s * x + c * y, z];
}

/** Along its own azimuth; at angle 0 it is unchanged; the swing reaches the widest tilt. */
function swung([x, y, z]: Triple, angle: number): Triple {
  const azimuth = Math.hypot(x, y) > 1e-9 ? Math.atan2(y, x) : 0;
  const tilt = Math.acos(Math.min(1, Math.max(-1, z / Math.hypot(x, y, z))));
  const widest = Math.max(WIDEST, tilt);
  const now = widest * Math.cos(Math.acos(tilt / widest) + angle);
  return [Math.sin(now) * Math.cos(azimuth), Math.sin(now) * Math.sin(azimuth), Math.cos(now)];
}
