/** Singular values of an asset's responses, beside those of its capture: how many components per texel the light of the scene would need. */
import { fetched } from "../src/files";
import type { Subject } from "./subject";

/** `srbf/viewer/measures.py`'s spectrum; values on one scale, largest first. */
export interface Spectrum {
  scalars: number;
  asset: number[];
  capture: number[] | null;
}

const MARGIN = { left: 44, right: 12, top: 24, bottom: 26 };
const FLOOR = 1e-4; // of the largest value

export class SpectrumPlot {
  private readonly found = new Map<string, Promise<Spectrum>>();

  constructor(private readonly canvas: HTMLCanvasElement) {}

  /** @throws SrbfError where it cannot be loaded. */
  async draw(subject: Subject): Promise<void> {
    const url = subject.facts.spectrum;
    let found = this.found.get(url);
    if (!found) {
      found = fetched(fetch.bind(window), url).then((response) => response.json());
      found.catch(() => this.found.delete(url));
      this.found.set(url, found);
    }
    this.plot(await found);
  }

  private plot({ asset, capture, scalars: components }: Spectrum): void {
    const ratio = Math.min(devicePixelRatio, 2);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    const c = this.canvas.getContext("2d") as CanvasRenderingContext2D;
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.clearRect(0, 0, width, height);
    const first = Math.max(asset[0] ?? 0, capture?.[0] ?? 0) || 1;
    const longest = Math.max(asset.length, capture?.length ?? 0, components, 10);
    const x = (rank: number) => MARGIN.left + ((width - MARGIN.left - MARGIN.right) * Math.log(rank)) / Math.log(longest);
    const y = (value: number) => MARGIN.top + ((height - MARGIN.top - MARGIN.bottom) * Math.log(Math.max(value / first, FLOOR))) / Math.log(FLOOR);
    c.font = "10px system-ui, sans-serif";
    c.textBaseline = "middle";
    c.lineWidth = 1;
    for (let decade = 1; decade >= FLOOR * 0.99; decade /= 10) {
      rule(c, [MARGIN.left, y(decade * first)], [width - MARGIN.right, y(decade * first)], "#ffffff18");
      c.fillStyle = "#8d96a1";
      c.textAlign = "right";
      c.fillText(decade === 1 ? "1" : `10${superscript(Math.round(Math.log10(decade)))}`, MARGIN.left - 6, y(decade * first));
    }
    c.textAlign = "center";
    for (let rank = 1; rank <= longest; rank *= 10) {
      rule(c, [x(rank), MARGIN.top], [x(rank), height - MARGIN.bottom], "#ffffff18");
      c.fillText(String(rank), x(rank), height - MARGIN.bottom + 10);
    }
    rule(c, [x(components), MARGIN.top], [x(components), height - MARGIN.bottom], "#ff8a6c");
    c.fillStyle = "#ff8a6c";
    c.textAlign = x(components) > width * 0.6 ? "right" : "left";
    c.fillText(`${components} per texel`, x(components) + (c.textAlign === "left" ? 5 : -5), MARGIN.top + 8);
    if (capture) curve(c, capture, x, y, first, "#9fb2c8");
    curve(c, asset, x, y, first, "#6ab7ff");
    c.textAlign = "left";
    c.fillStyle = "#6ab7ff";
    c.fillText("this asset", MARGIN.left, 11);
    c.fillStyle = "#9fb2c8";
    if (capture) c.fillText("its capture", MARGIN.left + 62, 11);
    c.fillStyle = "#8d96a1";
    c.textAlign = "right";
    c.fillText("singular values by rank", width - MARGIN.right, 11);
    this.canvas.dataset.drawn = JSON.stringify({ asset: asset.length, capture: capture?.length ?? 0, components });
  }
}

function curve(c: CanvasRenderingContext2D, values: number[], x: (rank: number) => number, y: (value: number) => number, first: number, color: string): void {
  c.beginPath();
  values.forEach((value, i) => {
    if (value >= FLOOR * first) c.lineTo(x(i + 1), y(value));
  });
  c.strokeStyle = color;
  c.lineWidth = 1.5;
  c.stroke();
  c.lineWidth = 1;
}

function rule(c: CanvasRenderingContext2D, from: [number, number], to: [number, number], color: string): void {
  c.beginPath();
  c.moveTo(...from);
  c.lineTo(...to);
  c.strokeStyle = color;
  c.stroke();
}

const superscript = (n: number) => (n < 0 ? "⁻" : "") + [...String(Math.abs(n))].map((digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(digit)]).join("");
