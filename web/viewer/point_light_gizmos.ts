/** Lights drawn in the scene: a bulb each, handles on the selected one, a spot's cone, an area's rectangle; and directional lights' directions. */
import {
  BufferAttribute,
  BufferGeometry,
  type Camera,
  Color,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  Object3D,
  type PerspectiveCamera,
  Scene,
  SphereGeometry,
  Vector3,
  type WebGLRenderer,
} from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import type { Triple } from "../src";
import { fromThree, toThree } from "./frames";
import { type AreaState, isAimed, isPlaced, type LightState, rounded, sides, type SpotState } from "./light_state";
import type { Bounds } from "./receivers";
import type { Changed, State } from "./state";

const BULB = 0.013; // of the distance to the eye
const SUN = 1.5; // scene radii from the middle

export class PointLightGizmos {
  /** What the handles of an aimed light move. */
  moving: "position" | "target" = "position";
  /** Captured lights, each in the color of its error, #rrggbb; the compared one is larger. */
  captured: readonly { position: Triple; color: string; marked: boolean }[] = [];
  private drawing = false; // the handles report every change, including those made by drawing
  private readonly overlay = new Scene();
  private readonly drawn = new Scene();
  private readonly controls: TransformControls;
  private readonly proxy = new Object3D();
  private readonly sphere = new SphereGeometry(1, 20, 12);
  private readonly materials = new Map<string, MeshBasicMaterial | LineBasicMaterial>();

  constructor(
    camera: PerspectiveCamera,
    canvas: HTMLCanvasElement,
    private readonly state: State,
    private readonly bounds: Bounds,
    changed: Changed,
    whileDragging: (dragging: boolean) => void,
  ) {
    this.controls = new TransformControls(camera, canvas);
    this.controls.setSize(0.75);
    this.overlay.add(this.proxy, this.controls.getHelper());
    this.controls.addEventListener("dragging-changed", (event) => whileDragging(event.value as boolean));
    this.controls.addEventListener("change", () => {
      if (!this.drawing) changed();
    });
    this.controls.addEventListener("objectChange", () => {
      const light = this.state.lights[this.state.selected];
      if (!isPlaced(light)) return;
      const place = rounded(fromThree(this.proxy.position));
      if (isAimed(light) && this.moving === "target") light.target = place;
      else light.position = place;
      this.state.playing = false;
      changed({ lights: true });
    });
  }

  get dragging(): boolean {
    return this.controls.dragging || this.controls.axis !== null;
  }

  /** Draw over the picture; directional lights are shown around a mesh only. */
  draw(renderer: WebGLRenderer, camera: PerspectiveCamera, suns: boolean): void {
    this.drawing = true;
    this.controls.camera = camera;
    this.attach();
    for (const object of this.drawn.children) if (object instanceof LineSegments) object.geometry.dispose();
    this.drawn.clear();
    for (const { position, color, marked } of this.captured) this.bulb(toThree(position), new Color(color), camera, marked ? 0.75 : 0.4);
    this.state.lights.forEach((light, i) => this.add(light, i === this.state.selected, camera, suns));
    renderer.render(this.drawn, camera);
    renderer.render(this.overlay, camera);
    this.drawing = false;
  }

  /** Attach the handles to the selected light if it has a place, or hide them. */
  private attach(): void {
    const light = this.state.lights[this.state.selected];
    if (!isPlaced(light) || !light.on) {
      if (this.controls.object) this.controls.detach();
      return;
    }
    if (!this.controls.dragging) this.proxy.position.copy(toThree(isAimed(light) && this.moving === "target" ? light.target : light.position));
    this.proxy.updateMatrixWorld(true);
    if (!this.controls.object) this.controls.attach(this.proxy);
  }

  private add(light: LightState, selected: boolean, camera: PerspectiveCamera, suns: boolean): void {
    if (!light.on || light.kind === "environment" || light.kind === "named") return;
    const color = new Color(light.color);
    if (light.kind === "directional") {
      if (!suns) return;
      const { center, radius } = this.bounds;
      const from = toThree(center);
      const to = from.clone().addScaledVector(toThree(light.direction).normalize(), SUN * radius);
      this.bulb(to, color, camera, selected ? 1.1 : 0.9);
      this.lines([from.clone().lerp(to, 0.12), from.clone().lerp(to, 0.94)], color, selected ? 0.55 : 0.25);
      return;
    }
    if (light.kind === "area") return this.rectangle(light, color, selected);
    this.bulb(toThree(light.position), color, camera, selected ? 1.25 : 1, light.kind === "sphere" ? light.size : 0);
    if (light.kind === "spot" && selected) this.cone(light, color);
  }

  /** Its outline, and an arrow's shaft along its axis. */
  private rectangle(light: AreaState, color: Color, selected: boolean): void {
    const [u, v] = sides(light).map(toThree);
    const middle = toThree(light.position);
    const corner = (a: number, b: number) => middle.clone().addScaledVector(u, a / 2).addScaledVector(v, b / 2);
    const round = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
    const facing = u.clone().cross(v).normalize().multiplyScalar(0.5 * Math.max(light.width, light.height));
    const shaft = [middle, middle.clone().add(facing)];
    this.lines([...round.flatMap((from, i) => [from, round[(i + 1) % 4]]), round[0], round[2], round[1], round[3], ...shaft], color, selected ? 1 : 0.7);
  }

  /** A ball of `size` on the screen, of at least `radius`, m. */
  private bulb(at: Vector3, color: Color, camera: Camera, size: number, radius = 0): void {
    const mesh = new Mesh(this.sphere, this.material(`bulb ${color.getHex()}`, () => new MeshBasicMaterial({ color })));
    mesh.position.copy(at);
    mesh.scale.setScalar(Math.max(radius, size * BULB * at.distanceTo(camera.position)));
    this.drawn.add(mesh);
  }

  private cone(light: SpotState, color: Color): void {
    const from = toThree(light.position);
    const axis = toThree(light.target).sub(from);
    const length = axis.length() || 1;
    axis.divideScalar(length);
    const side = Math.abs(axis.y) < 0.9 ? new Vector3(0, 1, 0).cross(axis).normalize() : new Vector3(1, 0, 0).cross(axis).normalize();
    const other = axis.clone().cross(side);
    const points: Vector3[] = [];
    const outer = (Math.min(light.outer, 89) * Math.PI) / 180;
    const at = (turn: number) =>
      from
        .clone()
        .addScaledVector(axis, length * Math.cos(outer))
        .addScaledVector(side, length * Math.sin(outer) * Math.cos(turn))
        .addScaledVector(other, length * Math.sin(outer) * Math.sin(turn));
    for (let i = 0; i < 32; ++i) {
      points.push(at((i / 16) * Math.PI), at(((i + 1) / 16) * Math.PI));
      if (i % 8 === 0) points.push(from, at((i / 16) * Math.PI));
    }
    this.lines(points, color, 0.6);
  }

  private lines(points: Vector3[], color: Color, opacity: number): void {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(points.flatMap((p) => p.toArray())), 3));
    const material = this.material(`line ${color.getHex()} ${opacity}`, () => new LineBasicMaterial({ color, opacity, transparent: true }));
    this.drawn.add(new LineSegments(geometry, material));
  }

  private material<M extends MeshBasicMaterial | LineBasicMaterial>(key: string, make: () => M): M {
    const material = this.materials.get(key) ?? make();
    this.materials.set(key, material);
    return material as M;
  }
}
