/** The panel's folder of objects that emit or are repainted. */
import type { GUI } from "three/addons/libs/lil-gui.module.min.js";
import type { Changed, State } from "./state";
import { isBaked, type SurfaceState, surfaceState } from "./surface_state";

const WHITE = "#cccccc"; // of a wall that is painted before its color is chosen
const BRIGHTEST = 20;

/** Of the objects `names`; `paintable`: whether their albedo can change. */
export function surfaceControls(gui: GUI, state: State, names: readonly string[], paintable: boolean, changed: Changed): void {
  const folder = gui.addFolder("Surfaces");
  if (!names.includes(state.surface)) state.surface = names[0];
  const edit = (change: (surface: SurfaceState) => void) => {
    const known = state.surfaces.find(({ name }) => name === state.surface) ?? surfaceState(state.surface);
    const next = { ...known };
    change(next);
    const others = state.surfaces.filter(({ name }) => name !== state.surface);
    state.surfaces = isBaked(next) && next.emission === surfaceState("").emission ? others : [...others, next];
  };
  const own = () => state.surfaces.find(({ name }) => name === state.surface) ?? surfaceState(state.surface);
  const shown = {
    get emission() {
      return own().emission;
    },
    set emission(value: string) {
      edit((surface) => (surface.emission = value));
    },
    get strength() {
      return own().strength;
    },
    set strength(value: number) {
      edit((surface) => (surface.strength = value));
    },
    get painted() {
      return own().albedo !== undefined;
    },
    set painted(value: boolean) {
      edit((surface) => (surface.albedo = value ? WHITE : undefined));
    },
    get albedo() {
      return own().albedo ?? WHITE;
    },
    set albedo(value: string) {
      edit((surface) => {
        if (surface.albedo !== undefined) surface.albedo = value;
      });
    },
    reset() {
      state.surfaces = [];
      changed({ lights: true, panel: true });
    },
  };
  const relight = () => changed({ lights: true });
  folder.add(state, "surface", [...names]).name("Object").onChange(() => changed({ panel: true }));
  folder.add(shown, "strength", 0, BRIGHTEST, 0.01).name("Emits").onChange(relight);
  folder.addColor(shown, "emission").name("Emitted color").onChange(relight);
  if (paintable) {
    folder.add(shown, "painted").name("Painted").onChange(() => changed({ lights: true, panel: true }));
    folder.addColor(shown, "albedo").name("Paint").onFinishChange(relight).enable(shown.painted);
  }
  folder.add(shown, "reset").name("All as baked");
}
