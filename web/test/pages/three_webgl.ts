/** Jobs for three.js' WebGLRenderer. */
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { relightGltf, SrbfProbes, SrbfRelightingMap } from "../../src/three";
import { change, type Job, lightOfJson, picture, upsideDown } from "./job";
import { addLights, facingCamera, placesMesh, quad, shadowScene } from "./three_scene";

let renderer: THREE.WebGLRenderer | undefined;

function shared(): THREE.WebGLRenderer {
  renderer ??= new THREE.WebGLRenderer({ antialias: false });
  renderer.toneMapping = THREE.NoToneMapping;
  renderer.debug.onShaderError = ((gl: WebGL2RenderingContext, program: never, vertex: never, fragment: never) => {
    throw new Error(`${gl.getProgramInfoLog(program)} ${gl.getShaderInfoLog(vertex)} ${gl.getShaderInfoLog(fragment)}`);
  }) as never; // other engines add to the DOM's types
  return renderer;
}

/** The lightmaps that the asset draws into its own target under one set of lights after the other. */
export async function threeLightmap(job: Job) {
  const options = { source: "lightmap", target: job.target ?? "float", filter: "nearest", verify: true, weights: job.weights as "gpu", exact: job.exact === true, shadowSize: job.shadowSize as number } as const;
  const map = await SrbfRelightingMap.load(job.asset, options);
  const { width, height } = map.asset.manifest;
  const { pass, gpu } = map as unknown as { pass: { target: THREE.WebGLRenderTarget }; gpu?: { computed?: number } };
  const { target } = pass;
  const milliseconds: number[] = []; // of each, until it can be read
  const pictures = job.lightSets.map((lights, i) => {
    map.lights.splice(0, map.lights.length, ...lights.map(lightOfJson));
    change(job, map, i);
    const start = performance.now();
    map.update(shared());
    const pixels = read(target, width, height);
    milliseconds.push(performance.now() - start);
    return picture(width, height, pixels);
  });
  map.dispose();
  return { pictures, milliseconds, computed: gpu?.computed };
}

/**
 * The lightmap by the shadows that three itself has drawn, one picture after the other of `job.kinds`: [type of the shadow map, light as in `follow`]. `job.blocker`:
 * corners of the triangles that cast shadows, in the asset's world.
 */
export async function threeShadows(job: Job) {
  const map = await SrbfRelightingMap.load(job.asset, { source: "lightmap", target: "float", filter: "nearest", weights: "gpu" });
  const { width, height } = map.asset.manifest;
  const target = (map as unknown as { pass: { target: THREE.WebGLRenderTarget } }).pass.target;
  const own = new THREE.WebGLRenderer({ antialias: false });
  own.shadowMap.enabled = true;
  const pixels = new Float32Array(width * height * 4);
  const pictures = (job.kinds as [string, Record<string, unknown>][]).map(([type, follow]) => {
    own.shadowMap.type = THREE[type as "PCFShadowMap"];
    const { scene, light, geometry } = shadowScene(job, map, follow);
    own.render(scene, facingCamera(job)); // three draws the shadow with the picture
    map.update(own);
    own.readRenderTargetPixels(target, 0, 0, width, height, pixels);
    map.unfollow(light);
    light.dispose();
    geometry.dispose();
    return picture(width, height, pixels);
  });
  map.dispose();
  own.dispose();
  return { pictures };
}

/** A quad of the receivers' plane under an orthographic camera, one pixel per texel. */
export async function threeMaterial(job: Job) {
  const map = await SrbfRelightingMap.load(job.asset, { source: job.source as "maps", filter: (job.filter as "nearest") ?? "nearest", target: "float" });
  const { width, height } = map.asset.manifest;
  const scene = new THREE.Scene();
  const kind = job.material as "MeshBasicMaterial";
  const material = new THREE[kind]({ color: new THREE.Color(...(job.color as [number, number, number])) });
  const mesh = quad(job, material);
  scene.add(mesh);
  if (job.reference) {
    const data = new Float32Array(job.reference as number[]);
    material.lightMap = new THREE.DataTexture(data, width, height, THREE.RGBAFormat, THREE.FloatType);
    material.lightMap.channel = 1;
    material.lightMap.needsUpdate = true;
  } else {
    addLights(job, map, scene);
    map.apply(material, job.apply as object);
    map.update(shared());
  }
  const size = (job.size as [number, number]) ?? [width, height];
  const target = new THREE.WebGLRenderTarget(size[0], size[1], { type: job.target === "half" ? THREE.HalfFloatType : THREE.FloatType });
  const frame = () => {
    shared().setRenderTarget(target);
    shared().render(scene, facingCamera(job));
    shared().setRenderTarget(null);
    return picture(size[0], size[1], upsideDown(read(target, size[0], size[1]), size[1])); // the framebuffer's row 0 is at the bottom
  };
  const first = frame();
  const pictures = job.lightSets.map((lights) => {
    map.lights.splice(0, map.lights.length, ...lights.map(lightOfJson));
    map.update(shared());
    return frame();
  });
  target.dispose();
  material.dispose();
  mesh.geometry.dispose();
  map.dispose();
  material.lightMap?.dispose();
  return { ...first, pictures, textures: shared().info.memory.textures, programs: shared().info.programs?.length };
}

/** White Lambert at `job.places` under one set of lights after the other, set on a lightmap asset whose lights the probes have; E / pi. */
export async function threeProbes(job: Job) {
  const map = await SrbfRelightingMap.load(job.beside as string);
  const probes = await SrbfProbes.load(job.asset, { target: job.target, weights: job.weights as "gpu", exact: job.exact === true, lightsOf: map });
  const material = new THREE.MeshLambertMaterial();
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = `attribute vec2 pixel;\n${shader.vertexShader.replace("#include <fog_vertex>", "gl_Position = vec4(pixel, 0.0, 1.0);")}`;
  };
  const scene = new THREE.Scene();
  scene.add(placesMesh(job, probes.apply(material)));
  const count = (job.places as unknown[]).length;
  const target = new THREE.WebGLRenderTarget(count, 1, { type: THREE.FloatType });
  const pictures = job.lightSets.map((lights) => {
    map.lights.splice(0, map.lights.length, ...lights.map(lightOfJson));
    probes.update(shared());
    shared().setRenderTarget(target);
    shared().render(scene, facingCamera(job));
    shared().setRenderTarget(null);
    return picture(count, 1, read(target, count, 1));
  });
  target.dispose();
  for (const one of [map, probes, material]) one.dispose();
  return { pictures };
}

/** A model of `srbf export --target gltf` as GLTFLoader reads it, lit by the asset that it names, from above. */
export async function threeGltf(job: Job) {
  const gltf = await new GLTFLoader().loadAsync(`${job.asset}/model.glb`);
  const meshes: THREE.Mesh[] = [];
  gltf.scene.traverse((object) => {
    if ((object as THREE.Mesh).isMesh) meshes.push(object as THREE.Mesh);
  });
  const fallback = meshes.map((mesh) => ((mesh.material as THREE.MeshBasicMaterial).map?.image as { width: number } | undefined)?.width ?? 0);
  const [map] = await relightGltf(gltf, job.asset, { filter: "nearest" });
  map.lights.push(...job.lights.map(lightOfJson));
  map.update(shared());
  const { width, height } = map.asset.manifest;
  const target = new THREE.WebGLRenderTarget(width, height, { type: THREE.FloatType });
  shared().setRenderTarget(target);
  shared().render(gltf.scene, facingCamera(job));
  shared().setRenderTarget(null);
  const pixels = read(target, width, height);
  target.dispose();
  map.dispose();
  return { ...picture(width, height, upsideDown(pixels, height)), fallback };
}

function read(target: THREE.WebGLRenderTarget, width: number, height: number): Float32Array {
  if (target.texture.type === THREE.FloatType) {
    const pixels = new Float32Array(width * height * 4);
    shared().readRenderTargetPixels(target, 0, 0, width, height, pixels);
    return pixels;
  }
  const halves = new Uint16Array(width * height * 4);
  shared().readRenderTargetPixels(target, 0, 0, width, height, halves);
  return Float32Array.from(halves, (bits) => THREE.DataUtils.fromHalfFloat(bits));
}
