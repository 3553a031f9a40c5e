/** The sphere of directions as a disc, equal areas for equal solid angles, zenith in the middle: directional lights are dragged on it, among the capture's. */
import type { Triple } from "../src";
import { directionalState, type DirectionalState, rounded } from "./light_state";
import type { Changed, State } from "./state";

const BELOW = 18; // degrees shown below a hemisphere's horizon
const GRAB = 14; // pixels

export interface DirectionPoint {
  direction: Triple;
  role: "train" | "validation" | "holdout" | "center";
}

/** The directions of a capture's lights, or of `centers` where it has none. */
export function directionPoints(lights: readonly { direction?: Triple; role: DirectionPoint["role"] }[] | undefined, centers: readonly Triple[]): readonly DirectionPoint[] {
  const baked = lights?.filter((light): light is DirectionPoint => light.direction !== undefined);
  return baked?.length ? baked : centers.map((direction): DirectionPoint => ({ direction, role: "center" }));
}

export class DirectionWidget {
  /** Index of the baked light that is compared with; -1 without one. */
  marked = -1;
  /** PSNR of every point, dB, shown as its color: worse is hotter. */
  errors?: readonly number[];
  private readonly context: CanvasRenderingContext2D;
  private readonly widest: number;
  private dragging = false;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly state: State,
    private readonly domain: "sphere" | "hemisphere",
    private points: readonly DirectionPoint[],
    private readonly changed: Changed,
  ) {
    this.context = canvas.getContext("2d") as CanvasRenderingContext2D;
    this.widest = domain === "sphere" ? Math.PI : ((90 + BELOW) * Math.PI) / 180;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => {
      if (this.dragging) this.move(event);
    });
    for (const end of ["pointerup", "pointercancel"] as const) canvas.addEventListener(end, () => (this.dragging = false));
  }

  /** Show the points of another asset. */
  show(points: readonly DirectionPoint[]): void {
    this.points = points;
  }

  /** Whether a direction lies in the captured domain. */
  inside(direction: Triple): boolean {
    return this.domain === "sphere" || direction[2] > 0;
  }

  draw(): void {
    if (this.canvas.hidden) return;
    const ratio = Math.min(devicePixelRatio, 2);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (this.canvas.width !== Math.round(width * ratio)) this.canvas.width = Math.round(width * ratio);
    if (this.canvas.height !== Math.round(height * ratio)) this.canvas.height = Math.round(height * ratio);
    const c = this.context;
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.clearRect(0, 0, width, height);
    this.ground();
    const range = this.errors && ends(this.errors);
    for (const [i, point] of this.points.entries()) this.dot(point, i === this.marked, range && ((this.errors as number[])[i] - range[0]) / (range[1] - range[0]));
    if (range) this.scale(range);
    this.state.lights.forEach((light, i) => {
      if (light.kind === "directional") this.sun(light, i === this.state.selected);
    });
  }

  /** The disc's middle and radius, CSS pixels. */
  private get disc(): { x: number; y: number; radius: number } {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return { x: width / 2, y: height / 2, radius: Math.min(width, height) / 2 - 12 };
  }

  /** Where a direction is on the canvas, CSS pixels. */
  project(d: Triple): [number, number] {
    const { x, y, radius } = this.disc;
    const theta = Math.acos(Math.min(1, Math.max(-1, d[2] / Math.hypot(...d))));
    const r = (radius * Math.sin(Math.min(theta, this.widest) / 2)) / Math.sin(this.widest / 2);
    const flat = Math.hypot(d[0], d[1]) || 1;
    return [x + (r * d[0]) / flat, y - (r * d[1]) / flat];
  }

  private direction(px: number, py: number): Triple {
    const { x, y, radius } = this.disc;
    const [dx, dy] = [(px - x) / radius, (y - py) / radius];
    const r = Math.min(1, Math.hypot(dx, dy));
    const theta = 2 * Math.asin(r * Math.sin(this.widest / 2));
    const azimuth = Math.atan2(dy, dx);
    return rounded([Math.sin(theta) * Math.cos(azimuth), Math.sin(theta) * Math.sin(azimuth), Math.cos(theta)]);
  }

  private down(event: PointerEvent): void {
    event.preventDefault();
    this.canvas.setPointerCapture(event.pointerId);
    this.dragging = true;
    const near = this.state.lights
      .map((light, i) => ({ light, i }))
      .filter(({ light }) => light.kind === "directional" && this.away((light as DirectionalState).direction, event) < GRAB)
      .sort((a, b) => this.away((a.light as DirectionalState).direction, event) - this.away((b.light as DirectionalState).direction, event))[0];
    const selected = this.state.lights[this.state.selected];
    const first = this.state.lights.findIndex((light) => light.kind === "directional");
    if (near) this.state.selected = near.i;
    else if (selected?.kind !== "directional" && first >= 0) this.state.selected = first;
    else if (first < 0) this.state.selected = this.state.lights.push(directionalState(this.direction(event.offsetX, event.offsetY))) - 1;
    this.changed({ panel: true });
    this.move(event);
  }

  private move(event: PointerEvent): void {
    const light = this.state.lights[this.state.selected];
    if (light?.kind !== "directional") return;
    light.direction = this.direction(event.offsetX, event.offsetY);
    this.state.playing = false;
    this.changed({ lights: true });
  }

  private away(direction: Triple, event: PointerEvent): number {
    const [x, y] = this.project(direction);
    return Math.hypot(x - event.offsetX, y - event.offsetY);
  }

  private ground(): void {
    const c = this.context;
    const { x, y, radius } = this.disc;
    const horizon = (radius * Math.sin(Math.PI / 4)) / Math.sin(this.widest / 2);
    const above = c.createRadialGradient(x, y - radius * 0.2, radius * 0.1, x, y, horizon);
    above.addColorStop(0, "#35506e");
    above.addColorStop(1, "#1d2733");
    const ground = this.domain === "sphere" ? "#221f1c" : "#15171a";
    circle(c, x, y, radius, ground);
    if (this.domain === "hemisphere") {
      c.save();
      c.beginPath();
      c.arc(x, y, radius, 0, 2 * Math.PI);
      c.clip();
      c.strokeStyle = "#23262b";
      c.lineWidth = 1;
      for (let i = -2 * radius; i < 2 * radius; i += 6) line(c, x + i - radius, y - radius, x + i + radius, y + radius);
      c.restore();
    }
    c.beginPath();
    c.arc(x, y, horizon, 0, 2 * Math.PI);
    c.fillStyle = above;
    c.fill();
    c.strokeStyle = "#5b6673";
    c.lineWidth = 1;
    c.stroke();
    c.strokeStyle = "#ffffff14";
    for (const elevation of [30, 60]) {
      const r = (radius * Math.sin(((90 - elevation) * Math.PI) / 360)) / Math.sin(this.widest / 2);
      c.beginPath();
      c.arc(x, y, r, 0, 2 * Math.PI);
      c.stroke();
    }
    line(c, x - horizon, y, x + horizon, y);
    line(c, x, y - horizon, x, y + horizon);
    c.fillStyle = "#8a939e";
    c.font = "10px system-ui, sans-serif";
    c.textAlign = "center";
    c.textBaseline = "middle";
    c.fillText("+X", x + radius + 4 > this.canvas.clientWidth - 8 ? x + radius - 8 : x + radius + 11, y);
    c.fillText("+Y", x, y - radius - 6);
  }

  /** `good`: 0 for the worst, 1 for the best. */
  private dot(point: DirectionPoint, marked: boolean, good?: number): void {
    const [x, y] = this.project(point.direction);
    if (good !== undefined) {
      circle(this.context, x, y, point.role === "train" ? (this.points.length > 150 ? 3.2 : 5) : 4.4, heat(1 - good));
      if (point.role === "holdout") this.ring(x, y, 4.4, "#ffffffb0", 1);
      if (marked) this.ring(x, y, 6.5, "#7fd1ff", 2);
      return;
    }
    const color = { train: "#9fb2c8a0", center: "#9fb2c8c0", validation: "#e0b35ac0", holdout: "#e08a5ac0" }[point.role];
    circle(this.context, x, y, point.role === "center" ? 1.8 : this.points.length > 150 ? 1.1 : 1.5, color);
    if (marked) this.ring(x, y, 5, "#7fd1ff", 2);
  }

  private ring(x: number, y: number, radius: number, color: string, width: number): void {
    this.context.strokeStyle = color;
    this.context.lineWidth = width;
    this.context.beginPath();
    this.context.arc(x, y, radius, 0, 2 * Math.PI);
    this.context.stroke();
  }

  /** What the colors of errors mean. */
  private scale([worst, best]: [number, number]): void {
    const c = this.context;
    const { clientHeight: height } = this.canvas;
    const [top, high] = [height - 92, 80];
    for (let i = 0; i < high; ++i) {
      c.fillStyle = heat(i / (high - 1));
      c.fillRect(4, top + i, 7, 1.5);
    }
    c.fillStyle = "#aab3bd";
    c.textAlign = "left";
    c.fillText(`${best.toFixed(1)} dB`, 15, top + 4);
    c.fillText(`${worst.toFixed(1)} dB`, 15, top + high - 4);
  }

  private sun(light: DirectionalState, selected: boolean): void {
    const c = this.context;
    const [x, y] = this.project(light.direction);
    c.globalAlpha = light.on ? 1 : 0.35;
    if (selected) circle(c, x, y, 12, "#ffffff26");
    circle(c, x, y, selected ? 7.5 : 6, "#0c0e10");
    circle(c, x, y, selected ? 6 : 4.5, light.color);
    c.globalAlpha = 1;
  }
}

/** The smallest and the largest of `values`, at least 0.1 apart. */
export function ends(values: readonly number[]): [number, number] {
  const [least, most] = [Math.min(...values), Math.max(...values)];
  return [least, Math.max(most, least + 0.1)];
}

/** Blue at 0, white between, red at 1. */
export function heat(x: number): string {
  const [cold, mild, hot] = [[66, 135, 245], [232, 230, 220], [235, 64, 40]];
  const [from, to, t] = x < 0.5 ? [cold, mild, 2 * x] : [mild, hot, 2 * x - 1];
  return `rgb(${from.map((value, i) => Math.round(value + (to[i] - value) * t)).join(" ")})`;
}

function circle(c: CanvasRenderingContext2D, x: number, y: number, r: number, fill: string): void {
  c.beginPath();
  c.arc(x, y, r, 0, 2 * Math.PI);
  c.fillStyle = fill;
  c.fill();
}

function line(c: CanvasRenderingContext2D, x0: number, y0: number, x1: number, y1: number): void {
  c.beginPath();
  c.moveTo(x0, y0);
  c.lineTo(x1, y1);
  c.stroke();
}
