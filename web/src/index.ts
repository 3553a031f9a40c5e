export { type Asset, type Basis, type LoadOptions, loadAsset } from "./asset";
export { SrbfError } from "./errors";
export type { ByteImage, FloatImage, HalfImage } from "./image";
export { type PointLightUniforms, pointLightRoom, pointLightUniforms, packedPointLights, versine } from "./point_light";
export type { LayerStack } from "./layers";
export {
  type DirectionalLight,
  directionalLight,
  type EnvironmentLight,
  environmentLight,
  type PunctualLight,
  type Light,
  moved,
  type PointLight,
  pointLight,
  type SpotLight,
  spotLight,
} from "./lights";
export { checkManifest, type Encoding, type LayerEntry, type Manifest, type Method } from "./manifest";
export { IDENTITY, type Matrix4, multiplied, type Triple, Z_UP_FROM_Y_UP } from "./matrix";
export { type FrameValues, frameValues, paddedCenters, shaderBody, shaderDefines, shaderText, uniformVectors } from "./shader";
export { projectedWeights } from "./weights";
