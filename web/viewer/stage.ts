/** The main picture: a mesh under an orbit camera, alone or in its scene, or texels as a picture to pan and zoom; point lights are drawn as gizmos. */
import {
  type BufferGeometry,
  DoubleSide,
  FrontSide,
  type Material,
  Mesh,
  type Object3D,
  PerspectiveCamera,
  Plane,
  PlaneGeometry,
  Raycaster,
  Scene,
  type Texture,
  Vector2,
  Vector3,
  WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Light, Triple } from "../src";
import type { Ball } from "./ball";
import { type FittedCamera, fromThree, toThree, viewCamera } from "./frames";
import { PointLightGizmos } from "./point_light_gizmos";
import { rounded } from "./light_state";
import type { Movement } from "./movement";
import { panAndZoom } from "./pan_zoom";
import { byTexels, type PixelLight } from "./pixel_light";
import type { Receivers } from "./receivers";
import { BACKGROUND, COLORS, screenMaterial, type ScreenUniforms, VALUES } from "./screen";
import type { Changed, State } from "./state";
import { Surroundings } from "./surroundings";

const BACKGROUND_BYTES = BACKGROUND.clone().convertLinearToSRGB(); // three encodes the clear color of a canvas, but not that of a target
const MOST_PIXEL_RATIO = 2;
const FIELD_OF_VIEW = 38; // degrees
const WIDE = 1.15; // width over height, from which on a window shows all of a scene's width

export class Stage {
  readonly gizmos: PointLightGizmos;
  private readonly scene = new Scene();
  private readonly picture = new Scene();
  private readonly orbit: OrbitControls;
  private readonly orbitCamera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 100);
  private camera: PerspectiveCamera | undefined;
  private readonly quad: Mesh;
  private readonly developed = new Scene();
  private readonly developedFrom: { value: Texture | null } = { value: null };
  private surroundings?: Surroundings;
  /** The receivers' meshes, in three's world. */
  readonly lit: Mesh[] = [];
  /** Light of the mesh's pixels, beside that of its texels. */
  pixelLight?: PixelLight;
  private ball?: { ball: Ball; meshes: Mesh[] };

  constructor(
    readonly renderer: WebGLRenderer,
    private readonly uniforms: ScreenUniforms,
    private readonly size: { width: number; height: number },
    private readonly state: State,
    private readonly receivers: Receivers,
    private readonly fitted: FittedCamera | undefined,
    private readonly model: Object3D | undefined,
    quantity: "irradiance" | "radiance",
    changed: Changed,
    private readonly movement: Movement,
  ) {
    this.quad = new Mesh(new PlaneGeometry(2, 2), screenMaterial(uniforms, "picture"));
    this.quad.frustumCulled = false;
    this.picture.add(this.quad);
    const among = model && Surroundings.in(model);
    if (model) this.addModel(model);
    if (model && among && this.lit.length) {
      this.surroundings = new Surroundings(model, uniforms, { quantity, atVertices: receivers.areVertices }, renderer);
      const developer = new Mesh(new PlaneGeometry(2, 2), screenMaterial({ ...uniforms, relit: this.developedFrom }, "screen"));
      developer.frustumCulled = false;
      this.developed.add(developer);
    }
    const canvas = renderer.domElement;
    this.orbit = new OrbitControls(this.orbitCamera, canvas);
    this.orbit.enableDamping = false;
    this.placeCamera();
    this.orbit.addEventListener("change", () => {
      this.state.eye = [rounded(fromThree(this.orbitCamera.position)), rounded(fromThree(this.orbit.target))];
      movement.moved();
      changed();
    });
    this.gizmos = new PointLightGizmos(this.orbitCamera, canvas, state, receivers.bounds, changed, (dragging) => {
      this.orbit.enabled = !dragging && this.hasMesh;
    });
    panAndZoom(canvas, state, size, this, changed);
  }

  /** Whether the mesh is shown, rather than a picture. */
  get hasMesh(): boolean {
    return this.lit.length > 0 && this.state.view !== "texels";
  }

  /** Whether there is a scene around the mesh. */
  get canShowScene(): boolean {
    return this.surroundings !== undefined;
  }

  /** Whether the mesh is shown in its scene; coefficient maps and other false colors are shown on the mesh alone. */
  private get inScene(): boolean {
    const { value, color } = this.uniforms;
    return this.canShowScene && this.state.view === "scene" && value.value === VALUES.picture && color.value !== COLORS.negative;
  }

  /** Show a sphere in the room, where the state has it. */
  setBall(ball: Ball, quantity: "irradiance" | "radiance"): void {
    const meshes = [ball.mesh];
    this.scene.add(ball.mesh);
    if (this.surroundings) {
      const own = new Mesh(ball.geometry);
      this.surroundings.add(own, { ...this.uniforms, ...byTexels(), relit: { value: ball.texture } }, quantity);
      meshes.push(own);
    }
    this.ball = { ball, meshes };
  }

  /** Whether a place of the canvas (CSS pixels) shows the sphere, with no handle over it. */
  ballAt(x: number, y: number): boolean {
    if (!this.ball || !this.showsBall || this.gizmos.dragging) return false;
    const caster = this.sight(x, y);
    const hit = caster.intersectObject(this.ball.ball.mesh)[0];
    return hit !== undefined && !(caster.intersectObjects(this.lit)[0]?.distance < hit.distance);
  }

  /** The place under (x, y) of the plane through `through` that faces the eye, in the asset's world. */
  onPlane(x: number, y: number, through: Triple): Triple | undefined {
    const plane = new Plane().setFromNormalAndCoplanarPoint(this.orbitCamera.getWorldDirection(new Vector3()), toThree(through));
    const found = this.sight(x, y).ray.intersectPlane(plane, new Vector3());
    return found ? fromThree(found) : undefined;
  }

  /** Whether the sphere is seen: in the picture, on a mesh. */
  private get showsBall(): boolean {
    const { value, color } = this.uniforms;
    return this.hasMesh && this.state.ball?.on === true && value.value === VALUES.picture && color.value !== COLORS.negative && this.state.compare === "off";
  }

  private placeBall(): void {
    const { ball } = this.state;
    if (!this.ball || !ball) return;
    for (const mesh of this.ball.meshes) {
      const before = JSON.stringify([mesh.visible, mesh.matrixWorld]);
      mesh.visible = this.showsBall;
      this.ball.ball.place(mesh, ball);
      if (JSON.stringify([mesh.visible, mesh.matrixWorld]) !== before) this.surroundings?.moved();
    }
  }

  private sight(x: number, y: number): Raycaster {
    const { clientWidth, clientHeight } = this.renderer.domElement;
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight), this.orbitCamera);
    return caster;
  }

  /** Turn the orbit camera about its target by `angle` (rad). */
  turn(angle: number): void {
    const { position } = this.orbitCamera;
    position.sub(this.orbit.target).applyAxisAngle(this.orbitCamera.up, angle).add(this.orbit.target);
    this.orbitCamera.lookAt(this.orbit.target);
    this.orbitCamera.updateMatrixWorld(true);
    this.state.eye = [rounded(fromThree(position)), rounded(fromThree(this.orbit.target))];
  }

  get canShowMesh(): boolean {
    return this.lit.length > 0;
  }

  /** Reset the orbit camera. */
  resetCamera(): void {
    this.state.eye = undefined;
    this.state.zoom = 0;
    this.placeCamera();
  }

  /** Set the camera from the state. */
  resetTo(): void {
    this.placeCamera();
  }

  resize(): void {
    const canvas = this.renderer.domElement;
    const { clientWidth: width, clientHeight: height } = canvas.parentElement as HTMLElement;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, MOST_PIXEL_RATIO));
    this.renderer.setSize(Math.max(1, width), Math.max(1, height));
    this.orbitCamera.aspect = width / Math.max(1, height);
    this.orbitCamera.fov = this.fieldOfView();
    this.placeCamera();
  }

  draw(lights: readonly Light[]): void {
    this.orbit.enabled = this.hasMesh && !this.gizmos.dragging;
    this.renderer.setClearColor(BACKGROUND);
    this.uniforms.split.value *= this.renderer.getPixelRatio();
    this.aim();
    const { x, y } = this.renderer.getDrawingBufferSize(new Vector2());
    this.render(lights, null, x, y);
    if (this.camera) {
      this.renderer.autoClear = false;
      this.gizmos.draw(this.renderer, this.camera, this.hasMesh);
    }
    this.uniforms.split.value /= this.renderer.getPixelRatio();
  }

  /**
   * The picture texel for texel, or the mesh at the screen's size, without gizmos; RGBA bytes, top row first. A view has its coverage as straight
   * alpha, and no background.
   */
  pixels(lights: readonly Light[]): { width: number; height: number; data: Uint8Array } {
    const buffer = this.renderer.getDrawingBufferSize(new Vector2());
    const { width, height } = this.hasMesh ? { width: buffer.x, height: buffer.y } : this.size;
    const target = new WebGLRenderTarget(width, height, { samples: this.hasMesh ? 4 : 0 });
    const kept = { split: this.uniforms.split.value };
    this.aim();
    const { left, wide } = this.spread();
    this.uniforms.split.value = this.hasMesh ? kept.split * this.renderer.getPixelRatio() : ((kept.split - left) / wide) * width;
    if (!this.hasMesh) {
      this.uniforms.pictureScale.value.set(1, 1);
      this.uniforms.pictureOffset.value.set(0, 0);
      this.uniforms.nearest.value = true;
    }
    this.uniforms.cutOut.value = !this.hasMesh;
    this.renderer.setClearColor(BACKGROUND_BYTES);
    this.render(lights, target, width, height);
    this.uniforms.cutOut.value = false;
    this.renderer.setRenderTarget(target);
    const upward = new Uint8Array(4 * width * height);
    this.renderer.readRenderTargetPixels(target, 0, 0, width, height, upward);
    this.renderer.setRenderTarget(null);
    target.dispose();
    this.uniforms.split.value = kept.split;
    const data = new Uint8Array(upward.length);
    for (let r = 0; r < height; ++r) data.set(upward.subarray(4 * width * (height - 1 - r), 4 * width * (height - r)), 4 * width * r);
    return { width, height, data };
  }

  /** Draw the picture without gizmos into `target`, or on the canvas, of `width` x `height` pixels. */
  private render(lights: readonly Light[], target: WebGLRenderTarget | null, width: number, height: number): void {
    const { renderer } = this;
    const behind = BACKGROUND.clone().multiplyScalar(1 / this.uniforms.toneMappingExposure.value); // so that exposure leaves it unchanged
    for (const mesh of this.lit) (mesh.material as Material).side = this.state.cut ? FrontSide : DoubleSide;
    this.surroundings?.cut(this.state.cut);
    this.placeBall();
    this.uniforms.atPixels.value = this.pixelLight !== undefined;
    const sides = this.state.cut ? "front" : this.inScene ? "as in the file" : "both";
    if (this.pixelLight?.draw(this.uniforms, lights, this.orbitCamera, { width, height, sides })) this.movement.drew();
    const whole = this.inScene ? (this.surroundings as Surroundings).draw(this.orbitCamera, lights, behind, width, height) : undefined;
    this.developedFrom.value = whole ?? null;
    renderer.autoClear = true;
    renderer.setRenderTarget(target);
    renderer.render(whole ? this.developed : this.hasMesh ? this.scene : this.picture, this.camera ?? this.orbitCamera);
  }

  /** What is seen at a place of the canvas (CSS pixels), in the asset's world. */
  pick(x: number, y: number): Triple | undefined {
    if (this.hasMesh) {
      const hit = this.sight(x, y).intersectObjects(this.lit)[0];
      return hit && fromThree(hit.point);
    }
    const { left, top, wide, high } = this.spread();
    return this.receivers.at((x - left) / wide, (y - top) / high);
  }

  /** Distance from the eye to a place, meters; without a camera, as if the whole scene were in view. */
  distance(place: Triple): number {
    const eye = this.hasMesh ? fromThree(this.orbitCamera.position) : this.fitted?.position;
    return eye ? Math.hypot(...place.map((x, i) => x - eye[i])) : 3 * this.receivers.bounds.radius;
  }

  /** Screen pixels per texel, and the picture's rectangle on the canvas, CSS pixels. */
  spread(): { zoom: number; left: number; top: number; wide: number; high: number } {
    const { clientWidth: w, clientHeight: h } = this.renderer.domElement;
    const { width, height } = this.size;
    const zoom = this.state.zoom || this.fit();
    const [mx, my] = this.state.zoom ? this.state.middle : [width / 2, height / 2];
    const ratio = this.renderer.getPixelRatio();
    const snapped = (x: number) => Math.round(x * ratio) / ratio;
    return { zoom, left: snapped(w / 2 - mx * zoom), top: snapped(h / 2 - my * zoom), wide: width * zoom, high: height * zoom };
  }

  /** Screen pixels per texel at which the picture fits the canvas. */
  fit(): number {
    const { clientWidth: w, clientHeight: h } = this.renderer.domElement;
    return Math.max(1e-3, Math.min((w - 48) / this.size.width, (h - 112) / this.size.height));
  }

  /** Place the picture, and the camera that gizmos are drawn with. */
  private aim(): void {
    if (this.hasMesh) {
      this.uniforms.nearest.value = false;
      this.camera = this.orbitCamera;
      return;
    }
    const { clientWidth: w, clientHeight: h } = this.renderer.domElement;
    const { zoom, left, top, wide, high } = this.spread();
    const scale: [number, number] = [wide / w, high / h];
    const offset: [number, number] = [(2 * left + wide) / w - 1, 1 - (2 * top + high) / h];
    this.uniforms.pictureScale.value.set(...scale);
    this.uniforms.pictureOffset.value.set(...offset);
    const device = zoom * this.renderer.getPixelRatio();
    this.uniforms.nearest.value = device >= 6 || Math.abs(device - Math.round(device)) < 1e-6;
    const { radius } = this.receivers.bounds;
    this.camera = this.fitted && viewCamera(this.fitted, scale, offset, radius * 1e-3, radius * 50);
  }

  private placeCamera(): void {
    const { radius } = this.receivers.bounds;
    const [eye, target] = this.state.eye ?? this.firstView();
    this.orbitCamera.near = radius * 0.01;
    this.orbitCamera.far = radius * 60;
    this.orbitCamera.position.copy(toThree(eye));
    this.orbit.target.copy(toThree(target));
    this.orbitCamera.updateProjectionMatrix();
    this.orbitCamera.lookAt(this.orbit.target);
    this.orbitCamera.updateMatrixWorld(true);
  }

  /**
   * From the position of the file's own camera, or from above and in front; it looks at the receivers' center. A narrow window is farther away; a camera among
   * the receivers, as in a room, stays there and sees as much by a wider angle.
   */
  private firstView(): [Triple, Triple] {
    const { center, radius } = this.receivers.bounds;
    const own = this.ownEye();
    if (own) return [this.isAmong(own) ? own : (own.map((x, i) => center[i] + (x - center[i]) * this.narrowness) as unknown as Triple), center];
    const away = radius * this.narrowness;
    return [[center[0] - 0.9 * away, center[1] - 2.1 * away, center[2] + 1.9 * away], center];
  }

  /** How much less of a scene's width the window shows than a usual one, 1 or more. */
  private get narrowness(): number {
    return Math.max(1, WIDE / this.orbitCamera.aspect);
  }

  /** Degrees, of the window's height. */
  private fieldOfView(): number {
    const own = this.ownEye();
    if (!own || !this.isAmong(own)) return FIELD_OF_VIEW;
    return (360 / Math.PI) * Math.atan(Math.tan((FIELD_OF_VIEW * Math.PI) / 360) * this.narrowness);
  }

  /** The position of the file's own camera. */
  private ownEye(): Triple | undefined {
    const own = (this.model?.userData.cameras as Object3D[] | undefined)?.[0];
    own?.updateWorldMatrix(true, false);
    return own && fromThree(new Vector3().setFromMatrixPosition(own.matrixWorld));
  }

  private isAmong(eye: Triple): boolean {
    const { center, radius } = this.receivers.bounds;
    return Math.hypot(...eye.map((x, i) => x - center[i])) < radius;
  }

  /** Meshes with the extension take the relit light; the rest of the file is ignored. */
  private addModel(model: Object3D): void {
    const material = screenMaterial(this.uniforms, this.receivers.areVertices ? "vertices" : "mesh");
    model.updateMatrixWorld(true);
    model.traverse((object) => {
      const mesh = object as Mesh<BufferGeometry, Material>;
      const extension = mesh.isMesh ? mesh.material.userData.gltfExtensions?.SRBF_relighting_map : undefined;
      if (!extension) return;
      const { geometry } = mesh;
      const uv = geometry.getAttribute(extension.texCoord ? `uv${extension.texCoord}` : "uv");
      if (!uv) return;
      geometry.setAttribute("lightmapUv", uv);
      const shown = new Mesh(geometry, material);
      shown.userData.surface = mesh.userData.surface;
      shown.applyMatrix4(mesh.matrixWorld);
      this.scene.add(shown);
      this.lit.push(shown);
    });
    this.scene.updateMatrixWorld(true);
  }
}
