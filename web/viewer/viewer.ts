/** The page at work: state, lights, picture, comparison, and what is saved. */
import { NoToneMapping, Vector4, WebGLRenderer } from "three";
import { type Light, type Triple } from "../src";
import { Copy } from "./copy";
import { type Environment, readEnvironment } from "./environment_file";
import { directionalState, environmentState, isLampState, lightOf, type LightState, linearColor, rounded } from "./light_state";
import { KEYS, listen } from "./keys";
import { checkGpu, type Loaded } from "./loading";
import { mapRange } from "./map_range";
import { element, lineOf, say } from "./messages";
import { Panel } from "./panel";
import { along } from "./path";
import { Receivers } from "./receivers";
import { rmse } from "./reference";
import { negated, ViewerRelighting } from "./relighting";
import { saveFrames, savePng } from "./saving";
import { COLOURS, screenUniforms, VALUES } from "./screen";
import { type SkyPoint, SkyWidget } from "./sky_widget";
import { Stage } from "./stage";
import { type Changed, COMPARES, decodeState, encodeState, MOST_LIGHTS, type State } from "./state";

const FRAMES_A_SECOND = 24;
const URL_EVERY = 350; // milliseconds: Safari allows a hundred in half a minute
const PACES = 15; // frames whose median is told
const ABOVE = 0.12; // of the distance to the eye: where a lamp hangs over what was picked

/** An asset on the page, drawn whenever a light or a control changed. */
export class Viewer {
  private readonly state: State;
  private readonly renderer: WebGLRenderer;
  private readonly relighting: ViewerRelighting;
  private readonly uniforms;
  private readonly receivers: Receivers;
  private readonly stage: Stage;
  private readonly sky: SkyWidget;
  private readonly panel: Panel;
  private readonly copy: Copy;
  private readonly environments = new Map<string, Environment>();
  private lightsChanged = true;
  private drawNeeded = true;
  private waiting = 0;
  private base?: { light: LightState; copy: LightState; turns: number };
  private compared = -1;
  private wanted = -1;
  private error = "";
  private last = 0;
  private readonly paces: number[] = [];
  private urlTimer = 0;
  private written = "";

  constructor(private readonly loaded: Loaded) {
    const { facts, asset, coverage, model, references } = loaded;
    this.renderer = new WebGLRenderer({ canvas: element<HTMLCanvasElement>("canvas"), antialias: true, preserveDrawingBuffer: true });
    this.renderer.toneMapping = NoToneMapping;
    checkGpu(this.renderer);
    const floats = this.renderer.extensions.has("OES_texture_float_linear") && this.renderer.extensions.has("EXT_color_buffer_float");
    this.relighting = new ViewerRelighting(asset, { source: "lightmap", target: floats ? "float" : "half", filter: "linear" });
    this.uniforms = screenUniforms(this.relighting.lightmap as never, this.relighting.textures);
    this.receivers = new Receivers(asset, coverage);
    this.copy = new Copy(asset.manifest.width, asset.manifest.height);
    this.state = this.begun();
    this.readUrl(location.hash);
    const changed: Changed = (what = {}) => this.changed(what);
    model?.applyMatrix4(this.relighting.sceneFromModel());
    const { width, height } = asset.manifest;
    this.stage = new Stage(this.renderer, this.uniforms, { width, height }, this.state, this.receivers, facts.camera ?? undefined, model, changed);
    const centers = asset.basis.kind === "gaussian" ? asset.basis.centers : asset.basis.functions.centers;
    const seen = centers.filter((direction) => asset.manifest.domain === "sphere" || direction[2] > 0); // light functions reach past the horizon
    const points: readonly SkyPoint[] = references?.lights ?? seen.map((direction): SkyPoint => ({ direction, role: "center" }));
    this.sky = new SkyWidget(element<HTMLCanvasElement>("sky"), this.state, asset.manifest.domain, points, changed);
    this.panel = new Panel(
      element("chips"),
      element("controls"),
      this.state,
      { maps: this.planes, hasPositions: asset.position !== undefined, hasMesh: this.stage.canShowMesh, hasCapture: references !== undefined, bounds: this.receivers.bounds },
      {
        changed,
        chooseEnvironment: () => this.chooseEnvironment(),
        savePng: () => this.savePicture(),
        saveFrames: () => saveFrames("FRAMES.json", [this.state.lights]),
        savePath: () => this.savePath(),
        resetCamera: () => {
          this.stage.resetCamera();
          changed();
        },
        moveTarget: (on) => {
          this.stage.gizmos.moving = on ? "target" : "position";
          changed();
        },
      },
    );
    this.title();
    this.events(changed);
    for (const note of loaded.notes) say(note, "hint");
    requestAnimationFrame((now) => this.frame(now));
  }

  /** How many maps, or scalar planes, there are to be looked at. */
  private get planes(): number {
    const { manifest, layers } = this.loaded.asset;
    return manifest.scalars ?? layers.count;
  }

  private begun(): State {
    const { facts, asset } = this.loaded;
    return {
      lights: [directionalState(rounded([-0.45, -0.5, 0.74]))],
      selected: 0,
      exposure: asset.manifest.quantity === "radiance" ? 1.65 : 0,
      tone: "linear",
      show: "picture",
      map: 0,
      compare: "off",
      split: 0.5,
      view: facts.mesh ? "mesh" : "texels",
      zoom: 0,
      middle: [asset.manifest.width / 2, asset.manifest.height / 2],
      path: "none",
      seconds: 8,
      playing: false,
    };
  }

  private readUrl(hash: string): void {
    try {
      const plain = this.begun();
      const state = decodeState(hash, plain);
      state.map = Math.min(state.map, this.planes - 1);
      if (!this.loaded.references) state.compare = "off";
      Object.assign(this.state, { eye: undefined }, state);
      for (const light of state.lights) {
        if (light.kind === "environment" && !this.environments.has(light.file)) say(`drop ${light.file} on the page again: an address holds no pictures`, "hint");
      }
    } catch (error) {
      say(lineOf(error));
    }
    this.written = hash;
  }

  private changed(what: { lights?: boolean; panel?: boolean }): void {
    this.drawNeeded = true;
    document.body.dataset.state = "busy";
    if (what.lights) this.lightsChanged = true;
    if (what.panel) this.panel.rebuild();
    document.body.dataset.address = "old";
    if (!this.urlTimer) {
      this.urlTimer = window.setTimeout(() => {
        this.urlTimer = 0;
        this.written = encodeState(this.state);
        history.replaceState(undefined, "", this.written);
        document.body.dataset.address = "written";
      }, URL_EVERY);
    }
  }

  private frame(now: number): void {
    requestAnimationFrame((next) => this.frame(next));
    const since = now - this.last;
    this.last = now;
    if (this.state.playing) this.play(since / 1000);
    else this.base = undefined;
    if (!this.drawNeeded) {
      if (document.body.dataset.state === "busy" && !this.waiting) document.body.dataset.state = "idle";
      return;
    }
    this.paces.push(since);
    if (this.paces.length > PACES) this.paces.shift();
    this.drawNeeded = false;
    try {
      if (this.lightsChanged) this.relight();
      this.lightsChanged = false;
      this.present();
      this.error = "";
    } catch (error) {
      const line = lineOf(error);
      if (line !== this.error) say(line);
      this.error = line;
    }
  }

  /** Until `waiting` is counted down again the page is not at rest. */
  private wait(): void {
    ++this.waiting;
    document.body.dataset.state = "busy";
  }

  private play(seconds: number): void {
    const light = this.state.lights[this.state.selected];
    if (!light) return;
    if (this.base?.light !== light) this.base = { light, copy: structuredClone(light), turns: 0 };
    this.base.turns += Math.min(seconds, 0.25) / this.state.seconds;
    Object.assign(light, this.moved(this.base.copy, this.base.turns));
    this.changed({ lights: true });
  }

  private moved(light: LightState, turns: number): LightState {
    const { centre, radius } = this.receivers.bounds;
    return along(light, this.state.path === "none" ? "turn" : this.state.path, turns, centre, radius);
  }

  private relight(): void {
    const lights = this.lights();
    if (this.state.show === "negative" && this.state.compare === "off") {
      this.relighting.set(negated(lights));
      this.relighting.update(this.renderer);
      this.uniforms.negative.value = this.copy.draw(this.renderer, this.relighting.lightmap as never);
    }
    this.relighting.set(lights);
    this.relighting.update(this.renderer);
  }

  /** The lights, or what they are compared by: the baked one that is nearest to the sun, in the sun's colour. */
  private lights(): Light[] {
    const { references, asset } = this.loaded;
    const sun = this.sun();
    element("status").dataset.rmse = "";
    if (this.state.compare === "off" || !references || !sun) {
      this.compared = this.wanted = this.sky.marked = -1;
      if (this.state.compare !== "off") say("comparing needs a sun: add one", "hint");
      return this.state.lights.map((light) => lightOf(light, this.environments)).filter((light) => light !== undefined);
    }
    this.want(references.nearest(sun.direction));
    const color = linearColor(sun);
    this.uniforms.referenceColour.value = color;
    if (this.compared < 0) return [];
    this.sky.marked = this.compared;
    const baked = references.lights[this.compared].direction;
    void references.image(this.compared).then((image) => {
      const relit = this.copy.read(this.renderer, this.relighting.lightmap as never);
      const error = rmse(relit, image, color, asset.ambient, (texel) => this.receivers.covered(texel));
      element("status").dataset.rmse = error.toPrecision(3);
      this.status();
    });
    return [{ kind: "directional", direction: baked, color }];
  }

  private sun() {
    const selected = this.state.lights[this.state.selected];
    const sun = selected?.kind === "directional" ? selected : this.state.lights.find((light) => light.kind === "directional");
    return sun?.kind === "directional" ? sun : undefined;
  }

  /** Compare with light `index` as soon as its picture is there. */
  private want(index: number): void {
    const { references } = this.loaded;
    if (!references || index === this.wanted) return;
    this.wanted = index;
    this.wait();
    references
      .image(index)
      .then((image) => {
        if (this.wanted !== index) return;
        this.uniforms.reference.value = references.asTexture(index, image);
        this.compared = index;
        this.changed({ lights: true });
      })
      .catch((error) => say(lineOf(error)))
      .finally(() => --this.waiting);
  }

  private present(): void {
    const { state, uniforms } = this;
    const comparing = state.compare !== "off" && this.compared >= 0;
    const value = comparing && state.compare !== "slider" ? state.compare : state.show === "map" && !comparing ? "map" : "picture";
    uniforms.value.value = VALUES[value as keyof typeof VALUES];
    const signed = value === "difference" || value === "map";
    const colour = signed ? "signed" : state.show === "false colour" ? "magnitude" : state.show === "negative" && !comparing ? "negative" : state.tone;
    uniforms.colour.value = COLOURS[colour];
    const most = value === "map" ? mapRange(this.loaded.asset, state.map) : 1;
    uniforms.toneMappingExposure.value = 2 ** state.exposure / most;
    uniforms.split.value = comparing && state.compare === "slider" ? state.split * this.renderer.domElement.clientWidth : 0;
    this.chooseMap();
    this.stage.draw();
    this.sky.draw();
    this.panel.refresh();
    this.bearing();
    this.legend(colour, most);
    const split = element("split");
    split.hidden = !(comparing && state.compare === "slider");
    for (const child of split.children) (child as HTMLElement).style.left = `${state.split * 100}%`;
    (split.querySelector("i") as HTMLElement).ariaValueNow = String(Math.round(100 * state.split));
    this.status();
  }

  private chooseMap(): void {
    const { asset } = this.loaded;
    const planes = asset.manifest.scalars !== undefined;
    const layer = planes ? Math.floor(this.state.map / 4) : this.state.map;
    const shader = this.uniforms;
    shader.layer.value = layer;
    shader.channel.value = planes ? this.state.map % 4 : -1;
    (shader.layerScale.value as Vector4).fromArray(asset.scale, 4 * layer);
    (shader.layerBias.value as Vector4).fromArray(asset.bias, 4 * layer);
  }

  private bearing(): void {
    const place = element("bearing");
    const sun = this.sun();
    if (!sun) {
      place.textContent = "drag on the sky to add a sun";
      return;
    }
    const shown = this.compared >= 0 && this.loaded.references ? this.loaded.references.lights[this.compared].direction : sun.direction;
    const [x, y, z] = shown;
    const elevation = (Math.asin(Math.min(1, Math.max(-1, z / Math.hypot(x, y, z)))) * 180) / Math.PI;
    const azimuth = ((Math.atan2(y, x) * 180) / Math.PI + 360) % 360;
    const inside = this.sky.inside(shown);
    place.classList.toggle("warn", !inside);
    place.textContent = `azimuth ${azimuth.toFixed(1)}°, elevation ${elevation.toFixed(1)}°${inside ? "" : " · the capture saw no light there"}`;
  }

  private legend(colour: keyof typeof COLOURS, range: number): void {
    const place = element("legend");
    const most = range * 2 ** -this.state.exposure;
    const text = (x: number) => String(Number(x.toPrecision(3)));
    place.hidden = colour !== "magnitude" && colour !== "signed" && colour !== "negative";
    if (place.hidden) return;
    const bars = {
      magnitude: ["linear-gradient(90deg,#30123b,#4668e0,#1bcfd4,#61fc6c,#d1e834,#fe9b2d,#d93806,#7a0402)", "0", "luminance", text(most)],
      signed: ["linear-gradient(90deg,#d9f0ff,#2e80ff,#121315,#ff4729,#ffedcc)", text(-most), "0", text(most)],
      negative: ["linear-gradient(90deg,#590d6b,#ff59ff)", "0", "below 0, cut off", text(-most / 8)],
    } as const;
    const [bar, left, middle, right] = bars[colour as keyof typeof bars];
    place.innerHTML = `<i style="background:${bar}"></i><div><span>${left}</span><span>${middle}</span><span>${right}</span></div>`;
  }

  private status(): void {
    const { asset, facts, references } = this.loaded;
    const pace = this.paces.length < PACES ? "–" : [...this.paces].sort((a, b) => a - b)[PACES >> 1].toFixed(1);
    const parts = [
      `<b>${pace}</b> ms a frame`,
      `<b>${(facts.resident_bytes / 2 ** 20).toFixed(1)}</b> MiB of asset on the GPU`,
    ];
    if (this.compared >= 0 && references) {
      const error = element("status").dataset.rmse;
      parts.push(`baked light <b>${this.compared}</b> (${references.lights[this.compared].role})${error ? `, rmse <b>${error}</b>` : ""}`);
    }
    if (asset.manifest.transport === "indirect") parts.push("indirect light alone");
    element("status").innerHTML = parts.map((part) => `<span>${part}</span>`).join("");
  }

  private title(): void {
    const { facts, asset } = this.loaded;
    const { manifest } = asset;
    const many = manifest.scalars === undefined ? `${asset.layers.count} maps` : `${manifest.scalars} planes`;
    const name = document.createElement("h1");
    name.textContent = facts.title;
    const line = document.createElement("p");
    line.textContent = [manifest.method.replaceAll("-", " "), many, `${manifest.width} × ${manifest.height} ${facts.kind === "view" ? "pixels" : "texels"}`, manifest.quantity].join(" · ");
    element("title").replaceChildren(name, line);
    element("help").innerHTML = `<h2>Keys</h2><table>${KEYS.map(([key, what]) => `<tr><td>${key}</td><td>${what}</td></tr>`).join("")}</table>`;
  }

  private events(changed: Changed): void {
    new ResizeObserver(() => {
      this.stage.resize();
      changed();
    }).observe(element("stage"));
    new ResizeObserver(() => changed()).observe(element("sky"));
    window.addEventListener("hashchange", () => {
      if (location.hash === this.written) return;
      this.readUrl(location.hash);
      this.stage.resetTo();
      changed({ lights: true, panel: true });
    });
    const help = element<HTMLDialogElement>("help");
    help.addEventListener("click", () => help.close());
    element("keys").addEventListener("click", () => help.showModal());
    const next = <T>(list: readonly T[], now: T) => list[(list.indexOf(now) + 1) % list.length];
    listen(this.state, changed, {
      reset: () => this.stage.resetCamera(),
      hide: () => document.body.classList.toggle("bare"),
      help: () => (help.open ? help.close() : help.showModal()),
      nextCompare: () => {
        if (this.loaded.references) this.state.compare = next(COMPARES, this.state.compare);
      },
      nextMap: () => {
        this.state.map = this.state.show === "map" ? (this.state.map + 1) % this.planes : this.state.map;
        this.state.show = "map";
      },
      nextView: () => {
        if (this.stage.canShowMesh) this.state.view = this.state.view === "mesh" ? "texels" : "mesh";
      },
    });
    const canvas = this.renderer.domElement;
    let tapped = 0;
    canvas.addEventListener("pointerup", (event) => {
      if (event.pointerType !== "mouse" && event.timeStamp - tapped < 300) this.place(event.offsetX, event.offsetY);
      tapped = event.timeStamp;
    });
    canvas.addEventListener("dblclick", (event) => this.place(event.offsetX, event.offsetY));
    canvas.addEventListener("webglcontextlost", () => say("the GPU gave up on this page: reload it"));
    this.dragSplit(changed);
    this.dropEnvironments();
  }

  /** Put the selected lamp above what is seen at a place of the canvas, or a new one. */
  private place(x: number, y: number): void {
    const place = this.stage.pick(x, y);
    if (!place) return;
    const light = this.state.lights[this.state.selected];
    const over = rounded([place[0], place[1], place[2] + ABOVE * this.stage.distance(place)]);
    if (isLampState(light)) {
      light.position = over;
      if (light.kind === "spot") light.target = rounded(place as Triple);
      this.changed({ lights: true });
    } else if (this.state.lights.length < MOST_LIGHTS) this.panel.add("point", over, over[2] - place[2]);
  }

  private dragSplit(changed: Changed): void {
    const handle = element("split").querySelector("i") as HTMLElement;
    const to = (fraction: number) => {
      this.state.split = Math.round(1e4 * Math.min(0.98, Math.max(0.02, fraction))) / 1e4;
      changed();
    };
    handle.addEventListener("pointerdown", (event) => {
      handle.setPointerCapture(event.pointerId);
      event.preventDefault();
    });
    handle.addEventListener("pointermove", (event) => {
      if (!handle.hasPointerCapture(event.pointerId)) return;
      const { left, width } = element("stage").getBoundingClientRect();
      to((event.clientX - left) / width);
    });
    handle.addEventListener("keydown", (event) => {
      if (event.key !== "ArrowLeft" && event.key !== "ArrowRight") return;
      to(this.state.split + (event.key === "ArrowLeft" ? -0.02 : 0.02));
      event.preventDefault();
      event.stopPropagation();
    });
  }

  private dropEnvironments(): void {
    const over = (on: boolean) => document.body.classList.toggle("dropping", on);
    window.addEventListener("dragover", (event) => {
      event.preventDefault();
      over(true);
    });
    window.addEventListener("dragleave", (event) => {
      if (!event.relatedTarget) over(false);
    });
    window.addEventListener("drop", (event) => {
      event.preventDefault();
      over(false);
      for (const file of event.dataTransfer?.files ?? []) void this.environment(file);
    });
  }

  private chooseEnvironment(): void {
    const input = document.createElement("input");
    input.type = "file";
    input.accept = ".exr,.hdr,.png";
    input.onchange = () => {
      if (input.files?.[0]) void this.environment(input.files[0]);
    };
    input.click();
  }

  /** A dropped sky; the first takes the suns' place. */
  private async environment(file: File): Promise<void> {
    this.wait();
    try {
      this.environments.set(file.name, await readEnvironment(file));
      const { lights } = this.state;
      const known = lights.findIndex((light) => light.kind === "environment" && light.file === file.name);
      if (known < 0 && lights.length >= MOST_LIGHTS) return say(`expected at most ${MOST_LIGHTS} lights; remove one first`);
      if (known < 0 && !lights.some((light) => light.kind === "environment")) for (const light of lights) light.on = false;
      this.state.selected = known < 0 ? lights.push(environmentState(file.name)) - 1 : known;
      this.changed({ lights: true, panel: true });
    } catch (error) {
      say(lineOf(error));
    } finally {
      --this.waiting;
    }
  }

  private savePicture(): void {
    savePng(`${this.loaded.facts.title}.png`, this.stage.pixels());
    this.changed({});
  }

  private savePath(): void {
    const { lights, selected, seconds } = this.state;
    const count = Math.max(1, Math.round(seconds * FRAMES_A_SECOND));
    const frame = (i: number) => lights.map((light, j) => (j === selected ? this.moved(light, i / count) : light));
    saveFrames("FRAMES.json", Array.from({ length: count }, (_, i) => frame(i)));
  }
}
