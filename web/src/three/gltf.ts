/** Models of `srbf export --target gltf`: their materials name the asset that lights them, by the extension SRBF_relighting_map. */
import { type Mesh, MeshLambertMaterial, type Object3D } from "three";
import type { LoadOptions } from "../asset";
import { type RelightingMapOptions, SrbfRelightingMap } from "./relighting_map";

export const GLTF_EXTENSION = "SRBF_relighting_map";

interface Extension {
  /** asset.json, relative to the model. */
  manifest: string;
  texCoord: number;
}

/**
 * Load the assets that a model's materials name, once each, and light its meshes by them: `gltf` is GLTFLoader's result, `folder` where it was loaded from. The
 * fixed-light picture that other viewers show is replaced by a white Lambert material with the same `side`.
 */
export async function relightGltf(
  gltf: { scene: Object3D },
  folder: string,
  options: RelightingMapOptions & LoadOptions = {},
): Promise<SrbfRelightingMap[]> {
  const found: [Mesh, Extension][] = [];
  gltf.scene.traverse((object) => {
    const material = (object as Mesh).material;
    if (material === undefined || Array.isArray(material)) return;
    const extension = (material.userData.gltfExtensions as Record<string, Extension> | undefined)?.[GLTF_EXTENSION];
    if (extension) found.push([object as Mesh, extension]);
  });
  const base = folder.replace(/\/*$/, "/");
  const names = [...new Set(found.map(([, extension]) => extension.manifest))];
  const maps = await Promise.all(names.map((name) => SrbfRelightingMap.load(base + name, options)));
  for (const [mesh, { manifest, texCoord }] of found) {
    const { side } = mesh.material as MeshLambertMaterial;
    mesh.material = maps[names.indexOf(manifest)].apply(new MeshLambertMaterial({ side }), { channel: texCoord as 0 | 1 | 2 | 3 });
  }
  return maps;
}
