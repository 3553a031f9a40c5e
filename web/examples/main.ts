/**
 * An asset in three.js. In the page's address: `asset`, the folder with asset.json. For a lightmap also `mesh`, a .glb of the scene, `object`, the name
 * of the mesh that the asset lights, and `channel`, its lightmap's UV set. `pointLight`: first position of the point light, x,y,z in three's world. `probes`, the
 * folder of an asset of probes, adds a white sphere at `sphere` that they light; a drag moves the light, or with shift the sphere.
 */
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { SrbfProbes, SrbfRelightingMap } from "srbf/three";

const query = new URLSearchParams(location.search);
const renderer = new THREE.WebGLRenderer({ antialias: true });
document.body.append(renderer.domElement);
const scene = new THREE.Scene();

const map = await SrbfRelightingMap.load(query.get("asset") ?? "asset");
const pointLight = new THREE.PointLight(0xffffff, Number(query.get("intensity") ?? 4));
pointLight.position.fromArray((query.get("pointLight") ?? "0.4,1,0.3").split(",").map(Number));
scene.add(pointLight);
map.follow(pointLight);

const probes = query.has("probes") ? await SrbfProbes.load(query.get("probes") as string, { lightsOf: map }) : undefined;
const sphere = new THREE.Mesh(new THREE.SphereGeometry(Number(query.get("radius") ?? 0.1), 48, 32), new THREE.MeshLambertMaterial());
sphere.position.fromArray((query.get("sphere") ?? "0,0.5,0").split(",").map(Number));
if (probes) {
  probes.apply(sphere.material);
  scene.add(sphere);
}

const camera = query.has("mesh") ? await lightmap() : view();

/** The asset's light on one mesh of a glTF scene, in place of three's own. */
async function lightmap(): Promise<THREE.Camera> {
  const gltf = await new GLTFLoader().loadAsync(query.get("mesh") as string);
  scene.add(gltf.scene);
  const mesh = gltf.scene.getObjectByName(query.get("object") as string) as THREE.Mesh;
  map.apply(mesh.material as THREE.MeshStandardMaterial, { channel: Number(query.get("channel") ?? 1) as 0 | 1 });
  return gltf.cameras[0];
}

/** A fixed view as a picture: its radiance replaces the material's light, its receivers' positions come from the position map. */
function view(): THREE.Camera {
  const { width, height } = map.asset.manifest;
  const material = map.apply(new THREE.MeshBasicMaterial(), { channel: 0, uvOrigin: "bottom" });
  scene.add(new THREE.Mesh(new THREE.PlaneGeometry(width / height, 1), material));
  const own = new THREE.OrthographicCamera(-width / height / 2, width / height / 2, 0.5, -0.5, -1, 1);
  return own;
}

function resize(): void {
  renderer.setSize(innerWidth, innerHeight);
  if (camera instanceof THREE.PerspectiveCamera) {
    camera.aspect = innerWidth / innerHeight;
    camera.updateProjectionMatrix();
  }
}
addEventListener("resize", resize);
resize();

renderer.domElement.addEventListener("pointermove", (event) => {
  const moved = event.shiftKey ? sphere : pointLight;
  if (event.buttons) moved.position.add(new THREE.Vector3(event.movementX, 0, event.movementY).multiplyScalar(0.005));
});

renderer.setAnimationLoop(() => {
  map.update(renderer);
  probes?.update(renderer);
  renderer.render(scene, camera);
});
