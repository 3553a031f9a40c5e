/** Files that are dropped on the page: keyframes to play, and environment maps. */
import { SrbfError } from "../src";
import { requireObjects } from "./asset_lights";
import { type Environment, readEnvironment } from "./environment_file";
import { FRAMES_PER_SECOND, Keyframes, readFrames } from "./keyframes";
import { environmentState } from "./light_state";
import { MOST_LIGHTS, type State } from "./state";
import type { Subject } from "./subject";

/** Keyframes that play from now on; `usual`: the falloff of lights that do not say; the subject tells what profiles and objects there are. @throws SrbfError on other files. */
export async function droppedFrames(file: File, state: State, usual: "linear" | "inverse-square", { asset, profiles }: Subject): Promise<Keyframes> {
  const frames = readFrames(await file.text(), file.name, usual, profiles);
  for (const lights of frames) requireObjects(asset, lights);
  const keyframes = new Keyframes(frames, state);
  keyframes.show(0);
  const { length } = keyframes.frames;
  Object.assign(state, { path: "frames", seconds: Math.max(0.1, length / FRAMES_PER_SECOND), playing: length > 1 });
  return keyframes;
}

/** Add an environment map, as `shineEnvironment`. @throws SrbfError where the asset takes none, there are too many lights, or it cannot be read. */
export async function droppedEnvironment(file: File, state: State, environments: Map<string, Environment>, takes: boolean): Promise<void> {
  if (!takes) throw new SrbfError("expected an asset of distant lights, a deep framebuffer or a room with windows for an environment, found one that knows none");
  environments.set(file.name, await readEnvironment(file));
  shineEnvironment(file.name, state);
}

/** Select the light of an environment map, or add it; the first one turns the other lights off. @throws SrbfError where there are too many lights. */
export function shineEnvironment(name: string, state: Pick<State, "lights" | "selected">): void {
  const { lights } = state;
  const known = lights.findIndex((light) => light.kind === "environment" && light.file === name);
  if (known < 0 && lights.length >= MOST_LIGHTS) throw new SrbfError(`expected at most ${MOST_LIGHTS} lights; remove one first`);
  if (known < 0 && !lights.some((light) => light.kind === "environment")) for (const light of lights) light.on = false;
  state.selected = known < 0 ? lights.push(environmentState(name)) - 1 : known;
}
