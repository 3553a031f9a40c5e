/** What keys do. */
import { rounded } from "./light_state";
import { type Changed, firstPath, type State } from "./state";

const STEP = (2 * Math.PI) / 180;
const LARGE_STEP = (10 * Math.PI) / 180;

const KEYS: [string, string][] = [
  ["← → ↑ ↓", "move the directional light by 2°, with shift by 10°"],
  ["space", "play or pause the path"],
  ["1 … 9", "select a light; switch a light of the scene on or off"],
  ["delete", "remove the light"],
  ["s", "the selected light alone, with others that are solo"],
  ["ctrl z, ctrl y", "take back, do again"],
  ["double click", "put the point light above a place, or aim the spot at it"],
  ["t", "the scene, the mesh alone, or texels"],
  ["a", "the next asset"],
  ["c", "next comparison with the capture"],
  ["m", "the next coefficient map"],
  ["r", "reset the view"],
  ["h", "hide the panel"],
  ["?", "this list"],
];

/** The list of keys, as HTML. */
export const tabled = () => `<h2>Keys</h2><table>${KEYS.map(([key, what]) => `<tr><td>${key}</td><td>${what}</td></tr>`).join("")}</table>`;

export function listen(state: State, changed: Changed, act: { reset(): void; hide(): void; undo(): void; redo(): void; help(): void; nextCompare(): void; nextMap(): void; nextView(): void; nextAsset(): void }): void {
  const heard = (event: KeyboardEvent) => {
    const target = event.target as HTMLElement;
    const control = event.ctrlKey || event.metaKey;
    if (control && !event.altKey && /^[zy]$/i.test(event.key) && !/^(TEXTAREA|SELECT)$/.test(target.tagName) && (target as HTMLInputElement).type !== "text") {
      event.preventDefault();
      if (event.key.toLowerCase() === "y" || event.shiftKey) act.redo();
      else act.undo();
      return;
    }
    if (/^(INPUT|SELECT|TEXTAREA)$/.test(target.tagName) || target.role === "slider" || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === " " && target.tagName === "BUTTON") return;
    const step = event.shiftKey ? LARGE_STEP : STEP;
    const turns: Record<string, [number, number]> = { ArrowLeft: [step, 0], ArrowRight: [-step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
    if (turns[event.key]) moveDirectional(state, ...turns[event.key]);
    else if (event.key === " ") {
      state.playing = !state.playing;
      if (state.playing && state.path === "none") state.path = firstPath(state);
    } else if (/^[1-9]$/.test(event.key) && Number(event.key) <= state.lights.length) {
      const light = state.lights[Number(event.key) - 1];
      if (light.kind === "named") light.on = !light.on;
      else state.selected = Number(event.key) - 1;
      changed({ panel: true });
    } else if ((event.key === "Delete" || event.key === "Backspace") && state.lights[state.selected] && state.lights[state.selected].kind !== "named") {
      state.lights.splice(state.selected, 1);
      state.selected = Math.min(state.selected, state.lights.length - 1);
      changed({ lights: true, panel: true });
    } else if (event.key === "s" && state.lights[state.selected] && state.lights[state.selected].kind !== "named") {
      const light = state.lights[state.selected];
      light.solo = light.solo ? undefined : true;
    } else if (event.key === "t") act.nextView();
    else if (event.key === "a") act.nextAsset();
    else if (event.key === "c") act.nextCompare();
    else if (event.key === "m") act.nextMap();
    else if (event.key === "r") act.reset();
    else if (event.key === "h") act.hide();
    else if (event.key === "?") act.help();
    else return;
    event.preventDefault();
    changed({ lights: true });
  };
  window.addEventListener("keydown", heard, { capture: true }); // the panel does not pass on what is pressed on its buttons
}

/** Move the selected directional light, or the first, by azimuth and elevation (rad); never over the zenith. */
function moveDirectional(state: State, azimuth: number, elevation: number): void {
  const selected = state.lights[state.selected];
  const sun = selected?.kind === "directional" ? selected : state.lights.find((light) => light.kind === "directional");
  if (sun?.kind !== "directional") return;
  const [x, y, z] = sun.direction;
  const height = Math.asin(Math.min(1, Math.max(-1, z / Math.hypot(x, y, z))));
  const now = Math.min(Math.PI / 2 - 1e-3, Math.max(-Math.PI / 2 + 1e-3, height + elevation));
  const turn = Math.atan2(y, x) + azimuth;
  sun.direction = rounded([Math.cos(now) * Math.cos(turn), Math.cos(now) * Math.sin(turn), Math.sin(now)]);
  state.playing = false;
}
