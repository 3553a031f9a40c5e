/** The page: its state, lights, picture, comparison, and what it saves. */
import { NoToneMapping, WebGLRenderer } from "three";
import { type Asset, type Light, lightDomainOf, type Triple } from "../src";
import { SrbfProbes } from "../src/three";
import { Address } from "./address";
import { assetFacts, capturedPlaces, designedOf, firstLights, inside, kindsOf, linkableOf, missingLine, outsideLine, redesign, requireObjects } from "./asset_lights";
import { Ball } from "./ball";
import { dragBall } from "./ball_drag";
import { firstBall, roomOf } from "./ball_state";
import { bearing, legend, slider, statusLine, titles } from "./captions";
import { Comparison } from "./comparison";
import { Copy } from "./copy";
import { Cycles } from "./cycles";
import { droppedEnvironment, droppedFrames, shineEnvironment } from "./dropped";
import type { Environment } from "./environment_file";
import { dragSplit, dropFiles, onDoubleTap, pickFile } from "./gestures";
import { History } from "./history";
import { type DirectionalState, isAimed, isPlaced, lightOf, type LightState, placedOf, type PlacedState, rounded, shiningOf, sunOf } from "./light_state";
import { listen, tabled } from "./keys";
import { FRAMES_PER_SECOND, type Keyframes } from "./keyframes";
import { checkGpu, type Loaded } from "./loading";
import { mapRange, showMap } from "./map_range";
import { Measures } from "./measures";
import { element, hintOnce, lineOf, say } from "./messages";
import { Movement } from "./movement";
import { Panel, type PanelFacts } from "./panel";
import { Playback } from "./path";
import { Receivers } from "./receivers";
import { negated } from "./relighting";
import { saveFrames, savePng, saveRig } from "./saving";
import { COLORS, screenUniforms, shownAs, VALUES } from "./screen";
import { directionPoints, DirectionWidget } from "./direction_widget";
import { Stage } from "./stage";
import { type Changed, COMPARES, decodeState, firstState, MOST_LIGHTS, type State, VIEWS } from "./state";
import { type Place, type Subject, Subjects, weightsFor } from "./subject";
import { emitting, emittingStates, paint } from "./surface_state";
import { Surroundings } from "./surroundings";

const PACES = 15; // frames whose median is shown
const ABOVE = 0.12; // of the distance to the eye: height of a point light above the picked place

/** Shows one of the page's assets, and draws whenever a light or a control has changed. */
export class Viewer {
  private readonly state: State;
  private readonly renderer: WebGLRenderer;
  private readonly subjects: Subjects;
  private subject: Subject;
  private readonly uniforms;
  private readonly inScene: boolean; // whether the page opens with the scene, which is radiance
  private readonly receivers: Receivers;
  private readonly playback: Playback;
  private readonly stage: Stage;
  private readonly movement: Movement;
  private readonly directions: DirectionWidget;
  private readonly panel: Panel;
  private readonly copy: Copy;
  private readonly comparison: Comparison;
  private readonly cycles?: Cycles;
  private readonly ball?: Ball;
  private keyframes?: Keyframes;
  private shining: Light[] = [];
  private readonly environments: Map<string, Environment>;
  private lightsChanged = true;
  private drawNeeded = true;
  private waiting = 0;
  private error = "";
  private last = 0;
  private readonly paces: number[] = [];
  private readonly address: Address;
  private readonly measures: Measures;
  private readonly history: History;

  private constructor(
    private readonly loaded: Loaded,
    first: Subject,
    subjects: Subjects,
    renderer: WebGLRenderer,
  ) {
    const { facts, model, probes, references } = loaded;
    this.environments = new Map(loaded.environments);
    this.renderer = renderer;
    this.subjects = subjects;
    this.subject = first;
    const { asset, coverage } = first;
    this.uniforms = screenUniforms(first.lightmap, first.relighting.textures, first.alpha);
    this.receivers = new Receivers(asset, coverage);
    this.copy = new Copy(asset.manifest.width, asset.manifest.height);
    this.inScene = model !== undefined && Surroundings.in(model);
    this.state = this.firstState();
    this.playback = new Playback(this.state, this.receivers.bounds);
    this.address = new Address(this.state);
    this.readUrl(location.hash);
    this.state.asset = facts.assets.indexOf(first.facts);
    this.history = new History(this.state);
    const changed: Changed = (what = {}) => this.changed(what);
    const waits = { wait: () => this.wait(), done: () => this.done() };
    this.comparison = new Comparison(references, this.uniforms, this.copy, this.receivers, { ...waits, changed: () => this.changed({ lights: true }), measured: () => this.status() });
    if (facts.cycles) this.cycles = new Cycles(facts.cycles, asset.ambient, { ...waits, shown: () => this.showReference(), switched: () => this.panel.rebuild(), told: () => this.status() });
    model?.applyMatrix4(first.relighting.sceneFromModel());
    const { width, height, quantity } = asset.manifest;
    this.movement = new Movement({ ...waits, changed });
    this.stage = new Stage(renderer, this.uniforms, { width, height }, this.state, this.receivers, facts.camera ?? undefined, model, quantity, changed, this.movement);
    if (this.state.view === "scene" && !this.stage.canShowScene) this.state.view = "mesh";
    if (probes && this.stage.canShowMesh) {
      this.ball = new Ball(renderer, new SrbfProbes(probes, { weights: weightsFor(probes, renderer) }), this.uniforms, asset, loaded.first.direct?.scene);
      this.stage.setBall(this.ball, quantity);
      dragBall(renderer.domElement, this.stage, this.state, roomOf(probes), changed);
    }
    this.directions = new DirectionWidget(element<HTMLCanvasElement>("directions"), this.state, asset.manifest.domain, directionPoints(this.loaded.references?.lights, this.subject.centers), changed);
    this.measures = new Measures(this.state, this.comparison, this.directions, { ...waits, changed });
    this.panel = new Panel(element("chips"), element("controls"), this.state, this.panelFacts(), {
      changed,
      chooseAsset: () => this.chooseAsset(),
      chooseEnvironment: () => pickFile(".exr,.hdr,.png", (file) => void this.environment(file)),
      savePng: () => {
        savePng(`${facts.title}.png`, this.stage.pixels(this.shining));
        changed();
      },
      saveFrames: () => this.save([this.state.lights]),
      saveRig: () => saveRig("lights.py", this.state.lights, this.subject.sunAngle, designedOf(this.subject.asset)),
      renderReference: () => void this.cycles?.render(this.state.lights),
      stopReference: () => this.cycles?.stop(),
      redesign: () => {
        redesign(this.subject.asset, this.state);
        changed({ lights: true, panel: true });
      },
      undo: () => this.step(this.history.undo()),
      redo: () => this.step(this.history.redo()),
      loadFrames: () => pickFile(".json", (file) => void this.frames(file)),
      savePath: () => this.save(this.state.path === "frames" && this.keyframes ? this.keyframes.frames : this.playback.frames(FRAMES_PER_SECOND)),
      resetCamera: () => {
        this.stage.resetCamera();
        changed();
      },
      moveTarget: (on) => {
        this.stage.gizmos.moving = on ? "target" : "position";
        changed();
      },
    }, element("mixer"));
    for (const name of ["directions", "bearing"]) element(name).hidden = lightDomainOf(asset.manifest) !== "directions";
    element("chips").hidden = this.named;
    titles(element("title"), this.loaded.facts, this.subject);
    this.events(changed);
    for (const note of loaded.notes) say(note, "hint");
    requestAnimationFrame((now) => this.frame(now));
  }

  /** @throws SrbfError where the GPU cannot show it. */
  static async start(loaded: Loaded): Promise<Viewer> {
    const renderer = new WebGLRenderer({ canvas: element<HTMLCanvasElement>("canvas"), antialias: true, preserveDrawingBuffer: true });
    renderer.toneMapping = NoToneMapping;
    checkGpu(renderer);
    const index = loaded.facts.assets.indexOf(loaded.first.facts);
    const subjects = new Subjects(loaded.facts, renderer, index, loaded.first);
    return new Viewer(loaded, await subjects.get(index), subjects, renderer);
  }

  /** Whether the lights are the scene's own, by name. */
  private get named(): boolean {
    return this.subject.asset.tables.names !== undefined;
  }

  private panelFacts(): PanelFacts {
    return {
      ...assetFacts(this.subject),
      assets: this.loaded.facts.assets.map(({ name }) => name),
      hasMesh: this.stage.canShowMesh,
      hasScene: this.stage.canShowScene,
      hasCapture: this.comparison.possible,
      bounds: this.receivers.bounds,
      named: this.named,
      hasFrames: this.keyframes !== undefined,
      cycles: this.cycles,
      room: this.ball && roomOf(this.loaded.probes as Asset),
    };
  }

  /** Show the asset that the state names, once it is loaded. */
  private chooseAsset(): void {
    const index = this.state.asset;
    this.wait();
    this.subjects
      .get(index)
      .then((subject) => {
        if (this.state.asset !== index) return;
        this.subject.restPixels();
        this.subject = subject;
        const { layers, ambient } = subject.relighting.textures;
        this.uniforms.relit.value = subject.lightmap;
        this.uniforms.layers.value = layers;
        this.uniforms.ambient.value = ambient;
        this.uniforms.coverage.value = subject.alpha;
        this.state.map = Math.min(this.state.map, subject.maps - 1);
        this.directions.show(directionPoints(this.loaded.references?.lights, this.subject.centers));
        this.directions.errors = undefined;
        this.panel.setFacts(this.panelFacts());
        titles(element("title"), this.loaded.facts, this.subject);
        this.changed({ lights: true, panel: true });
      })
      .catch((error) => {
        this.state.asset = this.loaded.facts.assets.indexOf(this.subject.facts);
        this.changed({ panel: true });
        say(lineOf(error));
      })
      .finally(() => this.done());
  }

  private firstState(): State {
    const { asset } = this.subject;
    const lights = firstLights(asset, this.receivers.bounds);
    const state = firstState(asset.manifest, this.inScene ? "scene" : this.loaded.model ? "mesh" : "texels", lights);
    const [environment] = this.loaded.environments.keys();
    if (environment !== undefined && state.lights.length < MOST_LIGHTS) shineEnvironment(environment, state);
    if (this.loaded.probes) state.ball = firstBall(this.loaded.probes, lights?.find(isPlaced)?.position, this.receivers.bounds.radius);
    return state;
  }

  private readUrl(hash: string): void {
    try {
      const plain = this.firstState();
      const state = decodeState(hash, plain);
      requireObjects(this.subject.asset, state.lights);
      state.asset = Math.min(state.asset, this.loaded.facts.assets.length - 1);
      state.map = Math.min(state.map, this.subject.maps - 1);
      if (!this.loaded.references && !this.cycles?.rendered) Object.assign(state, { compare: "off", errors: false });
      Object.assign(this.state, { eye: undefined }, state);
      for (const light of state.lights) {
        if (light.kind === "environment" && !this.environments.has(light.file)) say(`drop ${light.file} on the page again: an address holds no images`, "hint");
      }
    } catch (error) {
      say(lineOf(error));
    }
    this.address.take(hash);
  }

  private done(): void {
    --this.waiting;
  }

  private changed(what: { lights?: boolean; panel?: boolean }): void {
    this.drawNeeded = true;
    document.body.dataset.state = "busy";
    if (what.lights) this.lightsChanged = true;
    if (what.lights && this.subject.hasPixels) this.movement.moved();
    this.history.touch();
    if (what.panel) this.panel.rebuild();
    this.address.touch();
  }

  /** After a step back or forward, if there was one. */
  private step(changed: boolean): void {
    if (changed) this.changed({ lights: true, panel: true });
  }

  private frame(now: number): void {
    requestAnimationFrame((next) => this.frame(next));
    const since = now - this.last;
    this.last = now;
    this.movement.frame(since);
    if (this.state.playing) this.play(since / 1000);
    else this.playback.stop();
    if (!this.drawNeeded) {
      if (document.body.dataset.state === "busy" && !this.waiting) document.body.dataset.state = "idle";
      return;
    }
    this.paces.push(since);
    if (this.paces.length > PACES) this.paces.shift();
    this.drawNeeded = false;
    try {
      if (this.lightsChanged || this.subject.place !== this.shownAt()) this.relight();
      this.lightsChanged = false;
      this.present();
      this.error = "";
    } catch (error) {
      const line = lineOf(error);
      if (line !== this.error) say(line);
      this.error = line;
    }
  }

  /** The page counts as busy until `done` has been called as often. */
  private wait(): void {
    ++this.waiting;
    document.body.dataset.state = "busy";
  }

  private play(seconds: number): void {
    if (this.state.turntable && this.stage.hasMesh) {
      this.stage.turn((Math.PI * Math.min(seconds, 0.25)) / this.state.seconds);
      this.movement.moved();
      this.changed({});
    }
    if (this.state.path === "frames") this.playFrames(seconds);
    else if (this.playback.advance(seconds)) this.changed({ lights: true });
  }

  private playFrames(seconds: number): void {
    if (this.keyframes) return this.changed({ lights: true, panel: this.keyframes.advance(seconds) });
    this.state.playing = false;
    say("drop a FRAMES.json on the page to play it", "hint");
    this.changed({});
  }

  private relight(): void {
    const comparing = this.comparing();
    this.shining = this.lights();
    paint(this.subject.asset, comparing ? [] : this.state.surfaces);
    const terms = this.besideCycles ? "both" : comparing ? "indirect" : this.state.terms; // captures of indirect light hold nothing else
    if (this.state.show === "negative" && !comparing) {
      this.subject.relight(negated(this.shining), terms, this.renderer);
      this.uniforms.negative.value = this.copy.draw(this.renderer, this.subject.lightmap);
    }
    const { ball } = this.state;
    const shown = this.ball && ball?.on && !comparing ? ball : undefined;
    const began = performance.now();
    const place = this.shownAt();
    this.subject.relight(this.shining, terms, this.renderer, shown, place);
    const atPixels = place === "pixels" && terms !== "indirect";
    this.stage.pixelLight = atPixels ? this.subject.pixelLight(this.stage.lit, this.renderer, shown) : undefined;
    this.uniforms.texelShare.value = atPixels && terms === "direct" ? 0 : 1;
    // what reads the pixels waits for the GPU
    if (this.besideCycles) this.cycles?.measure(this.copy.read(this.renderer, this.subject.lightmap), (texel) => this.receivers.covered(texel), performance.now() - began);
    this.uniforms.relit.value = this.subject.shown;
    if (shown) this.ball?.relight(this.shining, this.state.surfaces, terms, shown);
    hintOnce("outside", outsideLine(this.subject.asset, this.state.lights));
    const light = this.comparable();
    if (comparing && light && this.comparison.compared >= 0) this.comparison.measure(this.subject, light, this.renderer);
  }

  /** Where the picture shows light. A mesh has finer direct light than its lightmap, and at its pixels where that is fast enough. */
  private shownAt(): Place {
    if (!this.stage.hasMesh || this.state.show !== "picture" || this.comparing()) return "texels";
    return this.subject.hasPixels && !this.besideCycles && this.movement.allowsPixels ? "pixels" : "mesh";
  }

  private showReference(): void {
    if (this.state.compare === "off") this.state.compare = "slider";
    this.changed({ lights: true, panel: true });
  }

  /** Whether a render by Cycles is beside the picture. */
  private get besideCycles(): boolean {
    return this.state.compare !== "off" && this.cycles?.rendered === true;
  }

  /** Whether the capture is beside the picture. */
  private comparing(): boolean {
    return !this.besideCycles && this.state.compare !== "off" && this.comparison.possible && this.comparable() !== undefined;
  }

  /** The lights, or while comparing the baked light nearest to the selected one, in its color. */
  private lights(): Light[] {
    const compared = this.comparable();
    if (!compared || !this.comparing()) {
      this.comparison.off();
      this.directions.marked = -1;
      if (this.state.compare !== "off" && !this.besideCycles) say(this.loaded.references ? `comparing needs a ${this.inCloud ? "point" : "directional"} light: add one` : "nothing to compare with yet: let Cycles render", "hint");
      const linkable = linkableOf(this.subject.asset).length > 0;
      const shown = shiningOf(this.state.lights).map((light) => (linkable ? light : { ...light, links: undefined }));
      return [...shown.flatMap((light) => lightOf(light, this.environments, this.subject.profiles) ?? []), ...emitting(this.subject.asset, this.state.surfaces)];
    }
    const light = this.comparison.light(compared);
    this.directions.marked = this.comparison.compared;
    return light ? [light] : [];
  }

  /** The light whose nearest baked one is compared with: the selected one, or the first that there is. */
  private comparable(): DirectionalState | PlacedState | undefined {
    return (this.inCloud ? placedOf : sunOf)(this.state);
  }

  /** Whether lights shine inside the scene. */
  private get inCloud(): boolean {
    return inside(this.subject.asset);
  }

  private present(): void {
    const { state, uniforms } = this;
    const comparing = this.besideCycles || (state.compare !== "off" && this.comparison.compared >= 0);
    if (this.besideCycles) this.cycles?.show(uniforms);
    const { value, color } = shownAs(state, comparing);
    uniforms.value.value = VALUES[value];
    uniforms.color.value = COLORS[color];
    const most = value === "map" ? mapRange(this.subject.asset, state.map) : 1;
    uniforms.toneMappingExposure.value = 2 ** state.exposure / most;
    uniforms.split.value = comparing && state.compare === "slider" ? state.split * this.renderer.domElement.clientWidth : 0;
    showMap(uniforms, this.subject.asset, state.map);
    this.measures.show(this.subject, this.inCloud);
    const placed = this.inCloud && (state.errors || comparing) ? (this.loaded.references?.lights ?? []) : [];
    this.stage.gizmos.captured = capturedPlaces(placed, this.directions.errors, this.comparison.compared);
    this.stage.draw(this.shining);
    this.directions.draw();
    this.panel.refresh();
    const shown = this.comparison.direction ?? sunOf(this.state)?.direction;
    bearing(element("bearing"), shown, shown !== undefined && this.directions.inside(shown));
    legend(element("legend"), color, most * 2 ** -state.exposure);
    slider(element("split"), comparing && state.compare === "slider", state.split);
    this.status();
  }

  private status(): void {
    const pace = this.paces.length < PACES ? undefined : [...this.paces].sort((a, b) => a - b)[PACES >> 1];
    statusLine(element("status"), this.subject, this.comparison, this.shining, this.state, pace, missingLine(this.subject, this.state.lights), this.cycles?.told(this.state.lights, this.besideCycles));
  }

  private events(changed: Changed): void {
    new ResizeObserver(() => {
      this.stage.resize();
      changed();
    }).observe(element("stage"));
    new ResizeObserver(() => changed()).observe(element("directions"));
    window.addEventListener("hashchange", () => {
      if (!this.address.take(location.hash)) return;
      this.readUrl(location.hash);
      if (this.loaded.facts.assets[this.state.asset] !== this.subject.facts) this.chooseAsset();
      this.stage.resetTo();
      changed({ lights: true, panel: true });
    });
    const help = element<HTMLDialogElement>("help");
    help.innerHTML = tabled();
    help.addEventListener("click", () => help.close());
    element("keys").addEventListener("click", () => help.showModal());
    const next = <T>(list: readonly T[], now: T) => list[(list.indexOf(now) + 1) % list.length];
    listen(this.state, changed, {
      reset: () => this.stage.resetCamera(),
      hide: () => document.body.classList.toggle("bare"),
      undo: () => this.step(this.history.undo()),
      redo: () => this.step(this.history.redo()),
      help: () => (help.open ? help.close() : help.showModal()),
      nextCompare: () => {
        if (this.loaded.references || this.cycles?.rendered) this.state.compare = next(COMPARES, this.state.compare);
      },
      nextMap: () => {
        if (this.subject.asset.tables.gather) return;
        this.state.map = this.state.show === "map" ? (this.state.map + 1) % this.subject.maps : this.state.map;
        this.state.show = "map";
      },
      nextView: () => {
        const views = VIEWS.filter((view) => view !== "scene" || this.stage.canShowScene);
        if (this.stage.canShowMesh) this.state.view = next(views, this.state.view === "scene" && !this.stage.canShowScene ? "mesh" : this.state.view);
      },
      nextAsset: () => {
        this.state.asset = (this.state.asset + 1) % this.loaded.facts.assets.length;
        this.chooseAsset();
      },
    });
    const canvas = this.renderer.domElement;
    onDoubleTap(canvas, (x, y) => this.place(x, y));
    canvas.addEventListener("webglcontextlost", () => say("the GPU context was lost: reload the page"));
    dragSplit(this.state, changed);
    dropFiles((file) => void (file.name.endsWith(".json") ? this.frames(file) : this.environment(file)));
  }

  /** Move the selected point light, or add one, above what is seen at a place of the canvas. */
  private place(x: number, y: number): void {
    const place = this.named ? undefined : this.stage.pick(x, y);
    if (!place) return;
    const light = this.state.lights[this.state.selected];
    const over = rounded([place[0], place[1], place[2] + ABOVE * this.stage.distance(place)]);
    if (isPlaced(light)) {
      light.position = over;
      if (isAimed(light)) light.target = rounded(place as Triple);
      this.changed({ lights: true });
    } else if (this.state.lights.length < MOST_LIGHTS) this.panel.add("point", over, over[2] - place[2]);
  }

  /** Play the frames of a file from now on. */
  private frames(file: File): Promise<void> {
    return this.slowly(async () => {
      this.keyframes = await droppedFrames(file, this.state, this.inCloud ? "inverse-square" : "linear", this.subject);
      this.panel.setFacts(this.panelFacts());
    });
  }

  private environment(file: File): Promise<void> {
    return this.slowly(() => droppedEnvironment(file, this.state, this.environments, kindsOf(this.subject.asset).includes("environment") && !this.named));
  }

  /** Do what takes time and changes lights; an error is said. */
  private async slowly(work: () => Promise<void>): Promise<void> {
    this.wait();
    try {
      await work();
      this.changed({ lights: true, panel: true });
    } catch (error) {
      say(lineOf(error));
    } finally {
      this.done();
    }
  }

  private save(frames: readonly (readonly LightState[])[]): void {
    saveFrames("FRAMES.json", frames.map((lights) => [...lights, ...emittingStates(this.subject.asset, this.state.surfaces)]), designedOf(this.subject.asset));
  }
}
