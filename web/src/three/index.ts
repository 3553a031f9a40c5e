export { GLTF_EXTENSION, relightGltf } from "./gltf";
export type { TargetOptions } from "./lightmap_pass";
export type { MaterialOptions } from "./material";
export { PROBE_SHADER, SrbfProbes, type ProbesOptions } from "./probes";
export { SrbfRelightingMap, type RelightingMapOptions } from "./relighting_map";
export { lightOf, type SceneLight } from "./scene_lights";
export { type Filter, SrbfTextures } from "./textures";
