/** The reference of the baked light that is nearest to the directional light, beside the relit picture; and every light's error. */
import type { WebGLRenderer } from "three";
import { type Light, pointLight, type Triple } from "../src";
import { fetched } from "../src/files";
import { Copy } from "./copy";
import { type DirectionalState, linearColor, type PlacedState } from "./light_state";
import { lineOf, say } from "./messages";
import type { Receivers } from "./receivers";
import { type References, rmse } from "./reference";
import type { ScreenUniforms } from "./screen";
import type { Subject } from "./subject";

/** `srbf/viewer/measures.py`'s errors, by light. */
export interface LightErrors {
  texels: number;
  rmse: number[];
  psnr: number[];
}

export class Comparison {
  /** Index of the baked light that is compared with; -1 without one. */
  compared = -1;
  /** Error of what is shown now, three digits; empty until it is known. */
  error = "";
  private wanted = -1;
  private readonly errorsOf = new Map<string, Promise<LightErrors>>();

  constructor(
    private readonly references: References | undefined,
    private readonly uniforms: ScreenUniforms,
    private readonly copy: Copy,
    private readonly receivers: Receivers,
    /** Called around slow work, and when there is something new to draw. */
    private readonly page: { wait(): void; done(): void; changed(): void; measured(): void },
  ) {}

  get possible(): boolean {
    return this.references !== undefined;
  }

  off(): void {
    this.compared = this.wanted = -1;
    this.error = "";
  }

  /** The baked light to relight by in place of `light`; undefined while its image is loading. */
  light(light: DirectionalState | PlacedState): Light | undefined {
    const references = this.references as References;
    this.error = "";
    this.want(references.nearest(light));
    const color = linearColor(light);
    this.uniforms.referenceColor.value = color;
    if (this.compared < 0) return undefined;
    const { direction, position } = references.lights[this.compared];
    if (position) return pointLight(position, { color, falloff: "inverse-square" });
    return direction && { kind: "directional", direction, color };
  }

  /** Measure the error of the relit picture, once what `light` returned has been drawn. */
  measure(subject: Subject, light: DirectionalState | PlacedState, renderer: WebGLRenderer): void {
    const [index, color] = [this.compared, linearColor(light)];
    void this.references?.image(index).then((image) => {
      if (index !== this.compared) return;
      const relit = this.copy.read(renderer, subject.lightmap);
      this.error = rmse(relit, image, color, subject.asset.ambient, (texel) => this.receivers.covered(texel)).toPrecision(3);
      this.page.measured();
    });
  }

  /** Role of the baked light that is compared with. */
  get role(): string {
    return this.references?.lights[this.compared]?.role ?? "";
  }

  /** Direction of the baked light that is compared with. */
  get direction(): Triple | undefined {
    return this.references?.lights[this.compared]?.direction;
  }

  /** Every light's error of `subject`, measured by the server on the first request. @throws SrbfError where that fails. */
  errors(subject: Subject): Promise<LightErrors> {
    const { errors: url } = subject.facts;
    if (!url) return Promise.reject(new Error("expected a capture to measure errors against, found none; pass it to srbf view"));
    let found = this.errorsOf.get(url);
    if (!found) {
      found = fetched(fetch.bind(window), url).then((response) => response.json());
      found.catch(() => this.errorsOf.delete(url));
      this.errorsOf.set(url, found);
    }
    return found;
  }

  /** Compare with light `index` as soon as its image is loaded. */
  private want(index: number): void {
    const { references } = this;
    if (!references || index === this.wanted) return;
    this.wanted = index;
    this.page.wait();
    references
      .image(index)
      .then((image) => {
        if (this.wanted !== index) return;
        this.uniforms.reference.value = references.asTexture(index, image);
        this.compared = index;
        this.page.changed();
      })
      .catch((error) => say(lineOf(error)))
      .finally(() => this.page.done());
  }
}
