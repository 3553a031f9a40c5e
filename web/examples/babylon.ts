/** A lightmap asset of a square plate, 2 m wide, in Babylon.js: `?asset=FOLDER`. A point light orbits above it. */
import { ArcRotateCamera } from "@babylonjs/core/Cameras/arcRotateCamera.js";
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { PBRMaterial } from "@babylonjs/core/Materials/PBR/pbrMaterial.js";
import { Color3 } from "@babylonjs/core/Maths/math.color.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { CreateGround } from "@babylonjs/core/Meshes/Builders/groundBuilder.js";
import { Scene } from "@babylonjs/core/scene.js";
import { pointLight } from "srbf";
import { SrbfRelightingMap } from "srbf/babylon";

const canvas = document.querySelector("canvas") as HTMLCanvasElement;
const engine = new Engine(canvas, true);
const scene = new Scene(engine);
scene.useRightHandedSystem = true;
const camera = new ArcRotateCamera("camera", Math.PI / 3, Math.PI / 4, 3, Vector3.Zero(), scene);
camera.minZ = 0.1;
camera.attachControl(canvas);

const plate = CreateGround("plate", { width: 2, height: 2 }, scene);
const material = new PBRMaterial("plate", scene);
material.albedoColor = new Color3(0.75, 0.55, 0.35);
material.metallic = 0;
material.roughness = 0.6;
plate.material = material;

const map = await SrbfRelightingMap.load(new URLSearchParams(location.search).get("asset") ?? "asset", scene);
map.apply(material, { uv: "uv" });

engine.runRenderLoop(() => {
  const turn = performance.now() / 4000;
  map.lights[0] = pointLight([0.9 * Math.cos(turn), 0.9 * Math.sin(turn), 1.1], { color: [6, 6, 6], falloff: "inverse-square" });
  map.update();
  scene.render();
});
addEventListener("resize", () => engine.resize());
