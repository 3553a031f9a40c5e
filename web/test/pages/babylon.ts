/** Jobs for Babylon.js under WebGL2. */
import { Camera } from "@babylonjs/core/Cameras/camera.js";
import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { Constants } from "@babylonjs/core/Engines/constants.js";
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { PBRMaterial } from "@babylonjs/core/Materials/PBR/pbrMaterial.js";
import { RenderTargetTexture } from "@babylonjs/core/Materials/Textures/renderTargetTexture.js";
import { Color3 } from "@babylonjs/core/Maths/math.color.js";
import { Matrix, Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import { VertexData } from "@babylonjs/core/Meshes/mesh.vertexData.js";
import { Scene } from "@babylonjs/core/scene.js";
import type { Triple } from "../../src";
import { SrbfRelightingMap } from "../../src/babylon";
import { type Job, lightOfJson, type LightJson, mix, picture, upsideDown } from "./job";

let engine: Engine | undefined;

/** A quad of the receivers' plane under an orthographic camera, one pixel per texel. */
export async function babylonMaterial(job: Job) {
  engine ??= new Engine(Object.assign(document.createElement("canvas"), { width: 1, height: 1 }), false); // drawn to, and not looked at
  const scene = new Scene(engine);
  scene.useRightHandedSystem = job.rightHanded === true;
  scene.imageProcessingConfiguration.applyByPostProcess = true; // linear values in the target
  const map = await SrbfRelightingMap.load(job.asset, scene, { filter: (job.filter as "nearest") ?? "nearest" });
  map.lights.push(...[...job.lights, ...((job.raw as LightJson[]) ?? [])].map(lightOfJson));
  mix(job, map);
  const { width, height } = map.asset.manifest;
  const material = new PBRMaterial("quad", scene);
  material.albedoColor = Color3.FromArray(job.color as number[]);
  material.metallic = 0;
  material.roughness = 1;
  material.metallicF0Factor = 0; // else 4 % of the light goes to highlights
  material.backFaceCulling = false;
  map.apply(material, job.apply as object);
  map.update();
  const mesh = quad(job, scene);
  mesh.material = material;
  const [a, b] = job.half as Triple;
  const camera = new FreeCamera("above", new Vector3(0, 50, 0), scene);
  camera.mode = Camera.ORTHOGRAPHIC_CAMERA;
  [camera.orthoLeft, camera.orthoRight, camera.orthoBottom, camera.orthoTop] = [-a, a, -b, b];
  const target = new RenderTargetTexture("target", { width, height }, scene, { type: Constants.TEXTURETYPE_FLOAT, generateMipMaps: false });
  target.renderList = [mesh];
  const lookAt = scene.useRightHandedSystem ? Matrix.LookAtRH : Matrix.LookAtLH;
  camera._getViewMatrix = () => lookAt(new Vector3(0, 50, 0), Vector3.Zero(), new Vector3(0, 0, -1)); // straight down has no rotation angles
  target.activeCamera = camera;
  scene.customRenderTargets.push(target);
  await material.forceCompilationAsync(mesh);
  await scene.whenReadyAsync();
  scene.render();
  const pixels = (await target.readPixels()) as Float32Array;
  scene.dispose();
  return picture(width, height, upsideDown(new Float32Array(pixels), height));
}

function quad(job: Job, scene: Scene): Mesh {
  const [a, b, z] = job.half as Triple;
  const s = scene.useRightHandedSystem ? 1 : -1;
  const mesh = new Mesh("quad", scene);
  const data = new VertexData();
  data.positions = [-a * s, z, -b, a * s, z, -b, -a * s, z, b, a * s, z, b];
  data.normals = [0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0];
  data.uvs2 = (job.uvs as number[]) ?? [0, 0, 1, 0, 0, 1, 1, 1];
  data.indices = [0, 2, 1, 1, 2, 3];
  data.applyToMesh(mesh);
  return mesh;
}
