/** Jobs for three.js' WebGPURenderer, on WebGPU or forced on WebGL2. */
import * as THREE from "three";
import { MeshBasicNodeMaterial, MeshLambertNodeMaterial, MeshStandardNodeMaterial, RectAreaLightNode, RenderTarget, WebGPURenderer } from "three/webgpu";
import { attribute, vec4 } from "three/tsl";
import { RectAreaLightTexturesLib } from "three/addons/lights/RectAreaLightTexturesLib.js";
import { SrbfProbeNodes, SrbfRelightingNodes } from "../../src/three/tsl";
import { change, type Job, lightOfJson, picture, upsideDown } from "./job";
import { addLights, facingCamera, placesMesh, quad, shadowScene } from "./three_scene";

const MATERIALS = { MeshStandardMaterial: MeshStandardNodeMaterial, MeshLambertMaterial: MeshLambertNodeMaterial, MeshBasicMaterial: MeshBasicNodeMaterial };
RectAreaLightNode.setLTC(RectAreaLightTexturesLib.init()); // as three.js asks of pages with area lights
const renderers = new Map<string, WebGPURenderer>();

async function rendererOf(job: Job): Promise<WebGPURenderer> {
  const backend = job.backend as string;
  let renderer = renderers.get(backend);
  if (!renderer) {
    renderer = new WebGPURenderer({ forceWebGL: backend === "webgl" });
    await renderer.init();
    const found = (renderer.backend as { isWebGPUBackend?: boolean }).isWebGPUBackend ? "webgpu" : "webgl";
    if (found !== backend) throw new Error(`expected the ${backend} backend, found ${found}`);
    renderer.toneMapping = THREE.NoToneMapping;
    renderers.set(backend, renderer);
  }
  return renderer;
}

/** The lightmaps that the asset draws into its own target under one set of lights after the other. */
export async function nodesLightmap(job: Job) {
  const renderer = await rendererOf(job);
  const map = await SrbfRelightingNodes.load(job.asset, { source: "lightmap", target: job.target ?? "float", filter: "nearest", weights: job.weights as "gpu", exact: job.exact === true, shadowSize: job.shadowSize as number });
  const { width, height } = map.asset.manifest;
  const pictures = [];
  for (const [i, lights] of job.lightSets.entries()) {
    map.lights.splice(0, map.lights.length, ...lights.map(lightOfJson));
    change(job, map, i);
    map.update(renderer);
    pictures.push(picture(width, height, await read(renderer, map.target as RenderTarget, width, height)));
  }
  map.dispose();
  return { pictures };
}

/** `threeShadows` of the WebGL page, by nodes. */
export async function nodesShadows(job: Job) {
  const pictures = [];
  const renderer = await rendererOf(job);
  renderer.shadowMap.enabled = true;
  const seen = new RenderTarget(16, 16);
  for (const [type, follow] of job.kinds as [string, Record<string, unknown>][]) {
    renderer.shadowMap.type = THREE[type as "PCFShadowMap"];
    const map = await SrbfRelightingNodes.load(job.asset, { source: "lightmap", target: "float", filter: "nearest", weights: "gpu" });
    const { width, height } = map.asset.manifest;
    const { scene, light } = shadowScene(job, map, follow, new MeshLambertNodeMaterial({ side: THREE.DoubleSide }));
    renderer.setRenderTarget(seen);
    renderer.render(scene, facingCamera(job)); // three draws the shadow with the picture
    renderer.setRenderTarget(null);
    if (!light.shadow.map) throw new Error("expected a shadow that three has drawn, found none");
    map.update(renderer);
    pictures.push(picture(width, height, await read(renderer, map.target as RenderTarget, width, height)));
    map.dispose();
  }
  renderer.shadowMap.enabled = false;
  seen.dispose();
  return { pictures };
}

/** `threeProbes` of the WebGL page, by nodes. */
export async function nodesProbes(job: Job) {
  const renderer = await rendererOf(job);
  const map = await SrbfRelightingNodes.load(job.beside as string);
  const probes = await SrbfProbeNodes.load(job.asset, { target: job.target, weights: job.weights as "gpu", exact: job.exact === true, lightsOf: map });
  const material = new MeshLambertNodeMaterial();
  material.vertexNode = vec4(attribute("pixel", "vec2") as never, 0, 1);
  const scene = new THREE.Scene();
  scene.add(placesMesh(job, probes.apply(material)));
  const count = (job.places as unknown[]).length;
  const target = new RenderTarget(count, 1, { type: THREE.FloatType });
  const pictures = [];
  for (const lights of job.lightSets) {
    map.lights.splice(0, map.lights.length, ...lights.map(lightOfJson));
    probes.update(renderer);
    renderer.setRenderTarget(target);
    await renderer.renderAsync(scene, facingCamera(job));
    renderer.setRenderTarget(null);
    pictures.push(picture(count, 1, await read(renderer, target, count, 1)));
  }
  target.dispose();
  for (const one of [map, probes, material]) one.dispose();
  return { pictures };
}

/** A quad of the receivers' plane under an orthographic camera, one pixel per texel. */
export async function nodesMaterial(job: Job) {
  const renderer = await rendererOf(job);
  const map = await SrbfRelightingNodes.load(job.asset, { source: job.source as "maps", filter: (job.filter as "nearest") ?? "nearest", target: "float" });
  const { width, height } = map.asset.manifest;
  const scene = new THREE.Scene();
  const material = new MATERIALS[job.material as "MeshBasicMaterial"]({ color: new THREE.Color(...(job.color as [number, number, number])) });
  const mesh = quad(job, material);
  scene.add(mesh);
  addLights(job, map, scene);
  map.apply(material, job.apply as object);
  map.update(renderer);
  const target = new RenderTarget(width, height, { type: job.target === "half" ? THREE.HalfFloatType : THREE.FloatType });
  renderer.setRenderTarget(target);
  await renderer.renderAsync(scene, facingCamera(job));
  renderer.setRenderTarget(null);
  const pixels = await read(renderer, target, width, height);
  target.dispose();
  material.dispose();
  mesh.geometry.dispose();
  map.dispose();
  return picture(width, height, pixels);
}

/** The target's rows from the picture's top: WebGPU hands them so, WebGL from the bottom. */
async function read(renderer: WebGPURenderer, target: RenderTarget, width: number, height: number): Promise<Float32Array> {
  const raw = (await renderer.readRenderTargetPixelsAsync(target, 0, 0, width, height)) as Float32Array | Uint16Array;
  const stride = raw.length / height; // WebGPU pads rows to 256 bytes
  const pixels = new Float32Array(width * height * 4);
  const value = (x: number) => (target.texture.type === THREE.FloatType ? x : THREE.DataUtils.fromHalfFloat(x));
  const packed = raw.length === pixels.length ? width * 4 : Math.round(stride);
  for (let row = 0; row < height; ++row) for (let i = 0; i < width * 4; ++i) pixels[row * width * 4 + i] = value(raw[row * packed + i]);
  return (renderer.backend as { isWebGPUBackend?: boolean }).isWebGPUBackend ? pixels : upsideDown(pixels, height);
}
