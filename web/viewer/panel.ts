/** The controls beside the picture: a chip per light, and folders of settings. */
import { GUI } from "three/addons/libs/lil-gui.module.min.js";
import type { Profile, Triple } from "../src";
import { areaState, type DirectionalState, directionalState, type EnvironmentState, isAimed, isPlaced, type LightState, type PlacedState, type PointLightState, pointState, rounded, shiningOf, sphereState, spotState } from "./light_state";
import type { AddedKind } from "./asset_lights";
import type { Box } from "./ball_state";
import type { Bounds } from "./receivers";
import { linkControls } from "./link_controls";
import { Mixer } from "./mixer";
import { type Changed, COMPARES, firstPath, MOST_LIGHTS, PATHS, SHOWS, type State, TERMS, TONES, VIEWS } from "./state";
import { surfaceControls } from "./surface_controls";
import { COLDEST, HOTTEST, temperatureColor } from "./temperature";

export interface Actions {
  changed: Changed;
  chooseEnvironment(): void;
  savePng(): void;
  saveFrames(): void;
  saveRig(): void;
  /** Let Cycles render the lights of now, and end that. */
  renderReference(): void;
  stopReference(): void;
  /** Set the scene's lights as they were designed. */
  redesign(): void;
  undo(): void;
  redo(): void;
  loadFrames(): void;
  savePath(): void;
  chooseAsset(): void;
  resetCamera(): void;
  moveTarget(on: boolean): void;
}

export interface PanelFacts {
  /** Coefficient maps of the asset that is shown, 0 where its layers are none. */
  maps: number;
  /** Kinds of lights that can be added. */
  kinds: readonly AddedKind[];
  /** Where a new light goes; above the receivers unless given. */
  middle?: Triple;
  hasDirect: boolean;
  /** Of suns without an angle of their own, degrees. */
  sunAngle: number;
  /** Profiles that lights may have, by name. */
  profiles: ReadonlyMap<string, Profile>;
  /** Names of all assets. */
  assets: string[];
  hasMesh: boolean;
  hasScene: boolean;
  hasCapture: boolean;
  bounds: Bounds;
  /** Whether its lights are the scene's own, by name. */
  named: boolean;
  hasFrames: boolean;
  /** Whether the asset lists lights of its scene, which can be set again as they were designed. */
  designed: boolean;
  /** Renders by Cycles, where the page may ask for them, and whether one can be compared with. */
  cycles?: { samples: number; rendering: boolean };
  /** Objects that lights may choose. */
  linkable: readonly string[];
  /** Whether a disc shows where directional lights are. */
  hasDisc: boolean;
  /** Objects that can emit, and whether they can be repainted. */
  objects: readonly string[];
  paintable: boolean;
  /** Where the moving sphere may be; undefined without probes. */
  room?: Box;
}

const KINDS = { directional: "Directional", point: "Point", spot: "Spot", sphere: "Sphere", area: "Area", environment: "Environment" } as const satisfies Record<AddedKind, string>;

const DAYLIGHT = 6500; // K: about white
const WIDEST_SUN = 20; // degrees

export class Panel {
  private gui: GUI | undefined;
  private readonly mixer: Mixer;
  private drawn = "";
  private readonly open = new Map<string, boolean>();

  constructor(
    private readonly chips: HTMLElement,
    private readonly controls: HTMLElement,
    private readonly state: State,
    private facts: PanelFacts,
    private readonly actions: Actions,
    mixer: HTMLElement,
  ) {
    this.mixer = new Mixer(mixer, state, actions.changed);
    this.rebuild();
  }

  /** Take the facts of another asset. */
  setFacts(facts: Partial<PanelFacts>): void {
    this.facts = { ...this.facts, ...facts };
  }

  /** Redraw after lights were added, removed or selected. */
  rebuild(): void {
    this.gui?.folders.forEach((folder) => this.open.set(folder._title, !folder._closed));
    const scrolled = this.controls.parentElement?.scrollTop ?? 0;
    this.gui?.destroy();
    this.gui = new GUI({ container: this.controls, title: "", autoPlace: false });
    this.lights();
    if (!this.facts.named) this.light();
    if (this.facts.designed) this.gui.add(this.actions, "redesign").name("As designed");
    this.gui.add(this.actions, "undo").name("Undo");
    this.gui.add(this.actions, "redo").name("Redo");
    const { objects, paintable } = this.facts;
    if (objects.length) surfaceControls(this.gui, this.state, objects, paintable, this.actions.changed);
    if (this.facts.room) this.ball(this.facts.room);
    this.picture();
    if (this.facts.hasCapture || this.facts.cycles) this.compare();
    this.path();
    this.save();
    this.gui.folders.forEach((folder) => folder.open(this.open.get(folder._title) ?? folder._title !== "Path"));
    if (this.controls.parentElement) this.controls.parentElement.scrollTop = scrolled;
  }

  /** Show numbers that have changed elsewhere. */
  refresh(): void {
    this.gui?.controllersRecursive().forEach((controller) => controller.updateDisplay());
    this.lights();
  }

  private lights(): void {
    this.mixer.refresh();
    if (!this.facts.named) this.drawChips();
  }

  private get selected(): LightState | undefined {
    return this.state.lights[this.state.selected];
  }

  private readonly relight = () => this.actions.changed({ lights: true });
  private readonly redraw = () => this.actions.changed();

  private drawChips(always = false): void {
    const { lights, selected } = this.state;
    const shining = new Set(shiningOf(lights));
    const drawn = JSON.stringify([selected, lights.map((light) => [light.kind, light.color, light.name, light.solo, shining.has(light)])]);
    if (!always && drawn === this.drawn) return; // replaced elements lose their focus
    this.drawn = drawn;
    const numbers = new Map<string, number>();
    const chips = lights.map((light, i) => {
      const number = (numbers.get(light.kind) ?? 0) + 1;
      if (light.name === undefined) numbers.set(light.kind, number);
      const chip = document.createElement("button");
      chip.className = `chip${i === selected ? " selected" : ""}${shining.has(light) ? "" : " off"}${light.solo ? " solo" : ""}`;
      chip.dataset.kind = light.kind;
      const dot = document.createElement("i");
      dot.style.background = light.color;
      const many = lights.filter((other) => other.kind === light.kind && other.name === undefined).length > 1;
      chip.append(dot, light.name ?? `${KINDS[light.kind as keyof typeof KINDS]}${many ? ` ${number}` : ""}`);
      chip.setAttribute("aria-pressed", String(i === selected));
      chip.onclick = () => {
        this.state.selected = i;
        this.actions.changed({ panel: true });
      };
      return chip;
    });
    const add = document.createElement("select");
    add.className = "chip add";
    add.setAttribute("aria-label", "Add a light");
    add.append(new Option("+ add", "", true, true), ...this.facts.kinds.map((kind) => new Option(KINDS[kind], kind)));
    add.onchange = () => this.add(add.value as keyof typeof KINDS);
    add.disabled = lights.length >= MOST_LIGHTS;
    this.chips.replaceChildren(...chips, add);
  }

  /** Add a light; a point or spot light at `at`, `height` above what it lights. */
  add(kind: keyof typeof KINDS, at?: Triple, height = 0.5 * this.facts.bounds.radius): void {
    const { center } = this.facts.bounds;
    const place: Triple = at ?? this.facts.middle ?? [center[0], center[1], center[2] + height];
    const below: Triple = this.facts.middle ? [place[0], place[1], place[2] - height] : center;
    if (kind === "environment") {
      this.actions.chooseEnvironment();
      this.drawChips(true);
      return;
    }
    const make = {
      directional: () => directionalState([-0.5, -0.5, 0.70711]),
      point: () => pointState(place, height),
      sphere: () => sphereState(place, height),
      spot: () => spotState(place, below, height),
      area: () => areaState(place, below, height),
    };
    this.state.selected = this.state.lights.push(make[kind]()) - 1;
    this.actions.changed({ lights: true, panel: true });
  }

  private light(): void {
    const light = this.selected;
    if (!light || !this.gui) return;
    const folder = this.gui.addFolder("Light");
    folder.add(light, "on").name("On").onChange(this.relight);
    this.solo(folder, light);
    folder
      .addColor(light, "color")
      .name("Color")
      .onChange(() => {
        light.kelvin = undefined;
        this.relight();
      });
    if (light.kind !== "environment") this.temperature(folder, light);
    folder.add(light, "intensity", 0, Math.max(10, 4 * light.intensity), 0.01).name("Intensity").onChange(this.relight);
    if (light.kind === "environment") this.environment(folder, light);
    if (isPlaced(light)) this.placed(folder, light);
    if (light.kind === "directional") {
      if (!this.facts.hasDisc) this.turned(folder, light);
      if (this.facts.hasDirect) this.angle(folder, light);
    }
    if (light.kind !== "environment" && this.facts.linkable.length) linkControls(folder.$children, light, this.facts.linkable, this.relight);
    const remove = {
      remove: () => {
        this.state.lights.splice(this.state.selected, 1);
        this.state.selected = Math.min(this.state.selected, this.state.lights.length - 1);
        this.actions.changed({ lights: true, panel: true });
      },
    };
    folder.add(remove, "remove").name("Remove");
  }

  private solo(folder: GUI, light: LightState): void {
    const proxy = {
      get solo() {
        return light.solo === true;
      },
      set solo(value: boolean) {
        light.solo = value || undefined;
      },
    };
    folder.add(proxy, "solo").name("Solo").onChange(this.relight);
  }

  private temperature(folder: GUI, light: LightState): void {
    const proxy = {
      get kelvin() {
        return light.kelvin ?? DAYLIGHT;
      },
      set kelvin(value: number) {
        light.kelvin = value;
        light.color = temperatureColor(value);
      },
    };
    folder.add(proxy, "kelvin", COLDEST, HOTTEST, 50).name("Temperature (K)").onChange(this.relight);
  }

  /** Where a directional light is, in degrees, where no disc shows it. */
  private turned(folder: GUI, light: DirectionalState): void {
    const degrees = 180 / Math.PI;
    const angles = () => {
      const [x, y, z] = light.direction;
      return [Math.atan2(y, x) * degrees, Math.asin(Math.min(1, Math.max(-1, z / Math.hypot(x, y, z)))) * degrees];
    };
    const turn = (azimuth: number, elevation: number) => {
      const level = Math.cos(elevation / degrees);
      light.direction = rounded([level * Math.cos(azimuth / degrees), level * Math.sin(azimuth / degrees), Math.sin(elevation / degrees)]);
    };
    const proxy = {
      get azimuth() {
        return angles()[0];
      },
      set azimuth(value: number) {
        turn(value, angles()[1]);
      },
      get elevation() {
        return angles()[1];
      },
      set elevation(value: number) {
        turn(angles()[0], value);
      },
    };
    folder.add(proxy, "azimuth", -180, 180, 0.1).name("Azimuth (°)").onChange(this.relight);
    folder.add(proxy, "elevation", -89.9, 89.9, 0.1).name("Elevation (°)").onChange(this.relight);
  }

  private environment(folder: GUI, light: EnvironmentState): void {
    folder.add(light, "file").name("File").disable();
    const proxy = {
      get turn() {
        return light.turn ?? 0;
      },
      set turn(value: number) {
        light.turn = value || undefined;
      },
    };
    folder.add(proxy, "turn", -180, 180, 0.1).name("Turn (°)").onChange(this.relight);
  }

  /** How wide a sun's disc is, which softens its shadows. */
  private angle(folder: GUI, light: DirectionalState): void {
    const { sunAngle } = this.facts;
    const proxy = {
      get angle() {
        return light.angle ?? sunAngle;
      },
      set angle(value: number) {
        light.angle = value;
      },
    };
    folder.add(proxy, "angle", 0, Math.max(WIDEST_SUN, proxy.angle), 0.01).name("Angle (°)").onChange(this.relight);
  }

  /** What shapes a light, and how it is turned; images are for spots alone. */
  private profile(folder: GUI, light: PointLightState): void {
    const fits = ({ projected }: Profile) => !projected || (light.kind === "spot" && light.outer < 90);
    const known = [...this.facts.profiles].flatMap(([name, profile]) => (fits(profile) ? [name] : []));
    const names = new Set(light.profile === undefined ? known : [...known, light.profile]);
    if (names.size === 0) return;
    const proxy = {
      get profile() {
        return light.profile ?? "";
      },
      set profile(name: string) {
        light.profile = name || undefined;
      },
      get turn() {
        return light.roll ?? 0;
      },
      set turn(value: number) {
        light.roll = value;
      },
    };
    const chosen = () => this.actions.changed({ lights: true, panel: true });
    folder.add(proxy, "profile", { None: "", ...Object.fromEntries([...names].map((name) => [name, name])) }).name("Profile").onChange(chosen);
    if (light.profile !== undefined) folder.add(proxy, "turn", -180, 180, 1).name("Turn of the profile (°)").onChange(this.relight);
  }

  private placed(folder: GUI, light: PlacedState): void {
    const { center, radius } = this.facts.bounds;
    const step = 10 ** Math.floor(Math.log10(radius / 100));
    const coordinates = (name: string, get: () => Triple, set: (place: Triple) => void) => {
      ["x", "y", "z"].forEach((axis, c) => {
        const proxy = {
          get place() {
            return get()[c];
          },
          set place(value: number) {
            set(rounded(get().map((x, i) => (i === c ? value : x)) as unknown as Triple));
          },
        };
        folder
          .add(proxy, "place", center[c] - 3 * radius, center[c] + 3 * radius, step)
          .name(`${name} ${axis} (m)`)
          .onChange(this.relight);
      });
    };
    coordinates("Position", () => light.position, (place) => (light.position = place));
    folder.add(light, "a0", step, 4 * radius, step).name("a₀ (m)").onChange(this.relight);
    if (light.kind !== "area") {
      folder.add(light, "falloff", { "1/d": "linear", "1/d²": "inverse-square" }).name("Falloff").onChange(this.relight);
      folder.add(light, "radius", 0.0001, radius, 0.0001).name(light.kind === "sphere" ? "Least distance (m)" : "Radius (m)").onChange(this.relight);
      this.profile(folder, light);
    }
    if (light.kind === "sphere") folder.add(light, "size", step, radius, step).name("Size (m)").onChange(this.relight);
    if (light.kind === "spot" && this.facts.hasDirect) {
      const proxy = {
        get size() {
          return light.size ?? 0;
        },
        set size(value: number) {
          light.size = value;
        },
      };
      folder.add(proxy, "size", 0, radius, step).name("Size (m)").onChange(this.relight);
    }
    if (isAimed(light)) {
      coordinates("Aim", () => light.target, (place) => (light.target = place));
      const target = { on: false };
      folder.add(target, "on").name("Handles move its aim").onChange(this.actions.moveTarget);
    }
    if (light.kind === "area") {
      folder.add(light, "width", step, 2 * radius, step).name("Width (m)").onChange(this.relight);
      folder.add(light, "height", step, 2 * radius, step).name("Height (m)").onChange(this.relight);
      folder.add(light, "turn", -180, 180, 1).name("Turn (°)").onChange(this.relight);
    }
    if (light.kind !== "spot") return;
    folder
      .add(light, "inner", 0, 89, 0.1)
      .name("Inner half-angle (°)")
      .onChange(() => {
        light.outer = Math.max(light.outer, light.inner);
        this.relight();
      });
    folder
      .add(light, "outer", 0, 89, 0.1)
      .name("Outer half-angle (°)")
      .onChange(() => {
        light.inner = Math.min(light.inner, light.outer);
        this.relight();
      });
  }

  private ball({ least, most }: Box): void {
    const { ball } = this.state;
    if (!ball || !this.gui) return;
    const folder = this.gui.addFolder("Moving sphere");
    folder.add(ball, "on").name("Shown").onChange(this.relight);
    ["x", "y", "z"].forEach((axis, c) => {
      const proxy = {
        get place() {
          return ball.position[c];
        },
        set place(value: number) {
          ball.position = rounded(ball.position.map((x, i) => (i === c ? value : x)) as unknown as Triple);
        },
      };
      folder.add(proxy, "place", least[c], most[c], 0.01).name(`Sphere ${axis} (m)`).onChange(this.relight);
    });
    folder.add(ball, "size", 0.01, Math.max(0.02, 0.25 * this.facts.bounds.radius), 0.01).name("Sphere radius (m)").onChange(this.relight);
  }

  private picture(): void {
    const folder = (this.gui as GUI).addFolder("Picture");
    const { assets, hasDirect, hasMesh, hasScene } = this.facts;
    if (assets.length > 1) {
      const names = Object.fromEntries(assets.map((name, i) => [name, i]));
      folder.add(this.state, "asset", names).name("Asset").onChange(this.actions.chooseAsset);
    }
    if (hasDirect) folder.add(this.state, "terms", { All: TERMS[0], Direct: TERMS[1], Indirect: TERMS[2] }).name("Light").onChange(this.relight);
    folder.add(this.state, "exposure", -8, 8, 0.05).name("Exposure (stops)").onChange(this.redraw);
    folder.add(this.state, "tone", { Linear: TONES[0], AgX: TONES[1], ACES: TONES[2] }).name("Tone").onChange(this.redraw);
    const { maps } = this.facts;
    const shows = { Picture: SHOWS[0], "False color": SHOWS[1], "Negative values": SHOWS[2], ...(maps ? { "Coefficient map": SHOWS[3] } : {}) };
    folder.add(this.state, "show", shows).name("Show").onChange(this.relight);
    const showMap = () => {
      this.state.show = "map";
      this.relight();
    };
    if (maps) folder.add(this.state, "map", 0, maps - 1, 1).name("Map").onChange(showMap);
    folder.add(this.state, "spectrum").name("Spectrum").onChange(this.redraw);
    const views = { ...(hasScene ? { Scene: VIEWS[0] } : {}), Mesh: VIEWS[1], Texels: VIEWS[2] };
    if (hasMesh) folder.add(this.state, "view", views).name("Show on").onChange(this.redraw);
    if (hasMesh) folder.add(this.state, "cut").name("Cut walls open").onChange(this.redraw);
    folder.add(this.actions, "resetCamera").name("Reset view");
  }

  private compare(): void {
    const folder = (this.gui as GUI).addFolder("Compare");
    const names = { Off: COMPARES[0], "Slider: reference | relit": COMPARES[1], Difference: COMPARES[2], Reference: COMPARES[3] };
    const { cycles, hasCapture } = this.facts;
    if (cycles) {
      folder.add(cycles, "samples", 1, 4096, 1).name("Samples");
      if (cycles.rendering) folder.add(this.actions, "stopReference").name("Stop the render");
      else folder.add(this.actions, "renderReference").name("Render with Cycles");
    }
    folder.add(this.state, "compare", names).name(cycles ? "With the render" : "With the capture").onChange(this.relight);
    if (hasCapture) folder.add(this.state, "errors").name("Error of each light").onChange(this.redraw);
  }

  private path(): void {
    const folder = (this.gui as GUI).addFolder("Path");
    const { hasFrames, named } = this.facts;
    const paths = { None: PATHS[0], ...(named ? {} : { Turn: PATHS[1], Swing: PATHS[2] }), ...(hasFrames ? { "FRAMES.json": PATHS[3] } : {}) };
    folder.add(this.state, "path", paths).name("Path").onChange(this.relight);
    folder.add(this.state, "seconds", 1, 60, 0.5).name("Period (s)").onChange(this.redraw);
    folder
      .add(this.state, "playing")
      .name("Play")
      .onChange(() => {
        if (this.state.playing && this.state.path === "none") this.state.path = firstPath(this.state);
        this.relight();
      });
    folder.add(this.actions, "loadFrames").name("Load FRAMES.json");
    if (this.facts.hasMesh) folder.add(this.state, "turntable").name("Turntable").onChange(this.redraw);
  }

  private save(): void {
    const folder = (this.gui as GUI).addFolder("Save");
    folder.add(this.actions, "savePng").name("Picture (PNG)");
    folder.add(this.actions, "saveFrames").name("Lights (FRAMES.json)");
    folder.add(this.actions, "savePath").name("Path (FRAMES.json)");
    if (!this.facts.named) folder.add(this.actions, "saveRig").name("Lights for Blender (Python)");
  }
}
