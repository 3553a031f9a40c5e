/** Jobs for PlayCanvas under WebGL2. */
import * as pc from "playcanvas";
import type { Triple } from "../../src";
import { SrbfRelightingMap } from "../../src/playcanvas";
import { type Job, lightOfJson, type LightJson, mix, picture, upsideDown } from "./job";

let app: pc.AppBase | undefined;

async function shared(): Promise<pc.AppBase> {
  if (!app) {
    const device = await pc.createGraphicsDevice(document.createElement("canvas"), { deviceTypes: [pc.DEVICETYPE_WEBGL2], antialias: false });
    const options = new pc.AppOptions();
    options.graphicsDevice = device;
    options.componentSystems = [pc.RenderComponentSystem, pc.CameraComponentSystem];
    app = new pc.AppBase(document.createElement("canvas"));
    app.init(options);
    app.autoRender = false;
    app.start();
  }
  return app;
}

/** A quad of the receivers' plane under an orthographic camera, one pixel per texel. */
export async function playcanvasMaterial(job: Job) {
  const own = await shared();
  const device = own.graphicsDevice;
  const map = await SrbfRelightingMap.load(job.asset, device, { filter: (job.filter as "nearest") ?? "nearest" });
  map.lights.push(...[...job.lights, ...((job.raw as LightJson[]) ?? [])].map(lightOfJson));
  mix(job, map);
  const { width, height } = map.asset.manifest;
  const material = map.material({ albedo: job.color as Triple, ...(job.apply as object) });
  material.cull = pc.CULLFACE_NONE;
  const [a, b, z] = job.half as Triple;
  const mesh = new pc.Mesh(device);
  mesh.setPositions([-a, z, -b, a, z, -b, -a, z, b, a, z, b]);
  mesh.setUvs(1, [0, 0, 1, 0, 0, 1, 1, 1]);
  mesh.setIndices([0, 2, 1, 1, 2, 3]);
  mesh.update();
  const quad = new pc.Entity("quad");
  quad.addComponent("render", { meshInstances: [new pc.MeshInstance(mesh, material)] });
  own.root.addChild(quad);
  const colorBuffer = new pc.Texture(device, { width, height, format: pc.PIXELFORMAT_RGBA32F, mipmaps: false });
  const camera = new pc.Entity("above");
  camera.addComponent("camera", {
    projection: pc.PROJECTION_ORTHOGRAPHIC,
    orthoHeight: b,
    aspectRatioMode: pc.ASPECT_MANUAL,
    aspectRatio: a / b,
    nearClip: 0.1,
    farClip: 100,
    renderTarget: new pc.RenderTarget({ colorBuffer, depth: true, samples: 1 }),
    gammaCorrection: pc.GAMMA_NONE,
    toneMapping: pc.TONEMAP_NONE,
  });
  camera.setPosition(0, 50, 0);
  camera.setEulerAngles(-90, 0, 0);
  own.root.addChild(camera);
  own.render();
  const pixels = (await colorBuffer.read(0, 0, width, height, { renderTarget: camera.camera?.renderTarget ?? undefined, immediate: true })) as Float32Array;
  const copied = new Float32Array(pixels);
  camera.destroy();
  quad.destroy();
  map.dispose();
  return picture(width, height, upsideDown(copied, height));
}
