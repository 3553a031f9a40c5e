/** The present lights, rendered by Cycles on this machine: asked for, waited for, and beside the relit picture. */
import { DataTexture, FloatType, LinearFilter, NoColorSpace, RGBAFormat } from "three";
import { type FloatImage, SrbfError } from "../src";
import { decodeFloat } from "../src/exr";
import { fetched } from "../src/files";
import { type LightState, shiningOf } from "./light_state";
import { lineOf, say } from "./messages";
import { frameOf } from "./saving";
import type { ScreenUniforms } from "./screen";

const EVERY = 300; // milliseconds between looks at how far it is
const QUANTILE = 0.999; // of the reference: the peak of the PSNR, as in srbf evaluate

/** viewer.json: `CyclesRenders.facts` of `srbf/viewer/cycles.py`. */
export interface CyclesFacts {
  place: string;
  scene: string;
  changed: string | null;
}

interface Status {
  state: "idle" | "rendering" | "done" | "stopped" | "failed";
  number?: number;
  done?: number;
  samples?: number;
  seconds?: number;
  render_seconds?: number;
  error?: string;
}

/** Error of the relit picture against the render, over covered texels. */
export interface CyclesError {
  relative: number;
  psnr: number;
}

/** What the status line says of it: the error of what is shown, milliseconds of the page's last picture, whether lights have changed since. */
export interface CyclesTold {
  line: string;
  error?: CyclesError;
  relitIn: number;
  isOld: boolean;
}

export class Cycles {
  samples = 64;
  rendering = false;
  /** The last render, its ambient light taken off, for the shader that adds it. */
  private texture?: DataTexture;
  private error?: CyclesError;
  private relitIn = 0;
  private image?: FloatImage;
  private of = "";
  private status: Status = { state: "idle" };

  constructor(
    readonly facts: CyclesFacts,
    private readonly ambient: FloatImage | undefined,
    private readonly page: { wait(): void; done(): void; shown(): void; switched(): void; told(): void },
  ) {}

  get rendered(): boolean {
    return this.image !== undefined;
  }

  /** What the status line says. */
  private get line(): string {
    const { state, done = 0, samples = 0, seconds, render_seconds: alone } = this.status;
    if (this.rendering) return state === "rendering" ? `Cycles: ${done} of ${samples} samples` : "Cycles: starting";
    if (!this.image) return "";
    return `Cycles: ${samples} samples in ${alone} s (${seconds} s with opening the scene)`;
  }

  /** Render the present lights. */
  async render(lights: readonly LightState[]): Promise<void> {
    if (this.rendering) return;
    if (hasEnvironment(lights)) return say("expected lights other than environments for a render by Cycles, found an environment; turn it off");
    this.rendering = true;
    this.status = { state: "idle" };
    this.page.wait();
    this.page.switched();
    this.page.told();
    const of = asked(lights);
    try {
      const number = (await this.ask("POST", JSON.stringify({ lights: JSON.parse(of), samples: this.samples }))).number;
      do {
        await new Promise((done) => setTimeout(done, EVERY));
        this.status = await (await fetched(fetch.bind(window), `${this.facts.place}/status.json`)).json();
        this.page.told();
      } while (this.status.state === "rendering" && this.status.number === number);
      if (this.status.state === "stopped" || this.status.number !== number) return say("the render was stopped", "hint");
      if (this.status.state !== "done") throw new SrbfError(`Cycles: ${this.status.error ?? this.status.state}`);
      const name = `${this.facts.place}/image.exr`;
      this.take(decodeFloat(await (await fetched(fetch.bind(window), name)).arrayBuffer(), name));
      this.of = of;
      this.page.shown();
    } catch (error) {
      say(lineOf(error));
    } finally {
      this.rendering = false;
      this.page.done();
      this.page.switched();
      this.page.told();
    }
  }

  stop(): void {
    if (this.rendering) this.ask("DELETE").catch((error) => say(lineOf(error)));
  }

  /** For the status line; `beside`: whether the render is. */
  told(lights: readonly LightState[], beside: boolean): CyclesTold {
    return { line: this.line, error: beside ? this.error : undefined, relitIn: this.relitIn, isOld: this.rendered && this.of !== asked(lights) };
  }

  /** Let the render be what the screen compares with. */
  show(uniforms: ScreenUniforms): void {
    if (this.texture) uniforms.reference.value = this.texture;
    uniforms.referenceColor.value = [1, 1, 1];
  }

  /** Measure RGBA pixels of the relit picture, in rows from the top, made in `relitIn` ms. */
  measure(relit: Float32Array, covered: (texel: number) => boolean, relitIn: number): void {
    const { image } = this;
    this.relitIn = relitIn;
    if (!image) return;
    const values: number[] = [];
    let [squares, power] = [0, 0];
    for (let i = 0; i < image.width * image.height; ++i) {
      if (!covered(i)) continue;
      for (let c = 0; c < 3; ++c) {
        const value = image.data[image.channels * i + c];
        squares += (relit[4 * i + c] - value) ** 2;
        power += value ** 2;
        values.push(value);
      }
    }
    const peak = values.sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor(QUANTILE * values.length))] ?? 0;
    const mean = squares / Math.max(1, values.length);
    this.error = { relative: Math.sqrt(squares / Math.max(power, 1e-30)), psnr: 10 * Math.log10(peak ** 2 / Math.max(mean, 1e-30)) };
  }

  private take(image: FloatImage): void {
    this.texture?.dispose();
    this.image = image;
    const { width, height, channels } = image;
    const data = new Float32Array(4 * width * height);
    for (let i = 0; i < width * height; ++i) {
      for (let c = 0; c < 3; ++c) data[4 * i + c] = image.data[channels * i + c] - (this.ambient ? this.ambient.data[this.ambient.channels * i + c] : 0);
      data[4 * i + 3] = 1;
    }
    this.texture = new DataTexture(data, width, height, RGBAFormat, FloatType);
    this.texture.colorSpace = NoColorSpace;
    this.texture.magFilter = this.texture.minFilter = LinearFilter;
    this.texture.needsUpdate = true;
  }

  private async ask(method: "POST" | "DELETE", body?: string): Promise<Status> {
    const response = await fetch(this.facts.place, { method, body, ...(body ? { headers: { "Content-Type": "application/json" } } : {}) });
    const text = await response.text();
    if (response.ok) return JSON.parse(text);
    const { error } = text.startsWith("{") ? JSON.parse(text) : { error: text };
    throw new SrbfError(error);
  }
}

const hasEnvironment = (lights: readonly LightState[]): boolean => shiningOf(lights).some(({ kind }) => kind === "environment");

/** The lights that shine, as the server takes them. */
const asked = (lights: readonly LightState[]): string => JSON.stringify(frameOf(lights).lights);
