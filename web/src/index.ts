export { type Asset, type LoadOptions, loadAsset } from "./asset";
export { type DistantLight, inAssetFrame, type LightsInAssetFrame } from "./asset_frame";
export { SrbfError } from "./errors";
export type { ByteImage, FloatImage, HalfImage } from "./image";
export { type PointLightUniforms, pointLightRoom, pointLightUniforms, packedPointLights, versine } from "./point_light";
export type { LayerStack } from "./layers";
export type { Links, Objects } from "./light_linking";
export { Profile } from "./light_profile";
export {
  type AreaLight,
  areaLight,
  type DirectionalLight,
  directionalLight,
  type EnvironmentLight,
  environmentLight,
  type PunctualLight,
  type Light,
  type NamedLight,
  namedLight,
  moved,
  type PointLight,
  pointLight,
  type SphereLight,
  sphereLight,
  type SpotLight,
  spotLight,
} from "./lights";
export { checkManifest, type Encoding, type LayerEntry, type LightDomain, lightDomainOf, type Manifest, type Receiver, receiverKind, type ReceiverKind } from "./manifest";
export { IDENTITY, type Matrix4, multiplied, type Triple, Z_UP_FROM_Y_UP } from "./matrix";
export { METHODS, methodNamed } from "./methods";
export type { Method, ReadOptions, Tables } from "./methods/method";
export { asDesigned, setNamedLight } from "./named_lights";
export { constantVectors, type FrameValues, frameValues, shaderBody, shaderDefines, shaderText, uniformVectors } from "./shader";
export { projectedWeights } from "./weights";
