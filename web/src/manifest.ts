/** asset.json, format srbf-asset, version 1: what is read of it, and the checks. Keys that are not known are ignored, unknown versions refused. */
import { SrbfError } from "./errors";
import type { Matrix4 } from "./matrix";
import { METHODS, methodNamed } from "./methods";
import type { Method } from "./methods/method";

export type Encoding = "half" | "float" | "uint8" | "bc7" | "bc1";
export type LightDomain = "directions" | "named" | "cloud" | "surfels" | "pool";
export type ReceiverKind = "lightmap" | "view" | "vertices" | "probes";

const ENCODINGS: readonly Encoding[] = ["half", "float", "uint8", "bc7", "bc1"];
const LIGHT_DOMAINS: readonly LightDomain[] = ["directions", "named", "cloud", "surfels", "pool"];
const RECEIVER_KINDS: readonly ReceiverKind[] = ["lightmap", "view", "vertices", "probes"];

/** A stored layer: value = stored * scale + bias, three channels of an RGB coefficient map, or four of scalar ones. */
export interface LayerEntry {
  file: string;
  encoding: Encoding;
  scale: number[];
  bias: number[];
  /** Which layer of the file, where one file holds all. */
  layer?: number;
  /** Mip levels that the file holds. */
  levels?: number;
}

export interface Receiver {
  kind: ReceiverKind;
}

/** The keys that every method has; a method's file types its own. */
export interface Manifest {
  format: "srbf-asset";
  version: 1;
  method: string;
  quantity: "irradiance" | "radiance";
  transport?: "combined" | "indirect";
  width: number;
  height: number;
  /** What a light's coordinates are; directions unless given. */
  light_domain?: LightDomain;
  /** Which directions were captured; an asset of another light domain has none. */
  domain: "sphere" | "hemisphere";
  /** What is lit. `receivers` where several objects share one lightmap. */
  receiver?: Receiver;
  receivers?: Receiver[];
  position?: string;
  normal?: string;
  coverage?: string;
  ambient?: string;
  albedo?: string;
  /** The .glb of what casts, of indirect assets. */
  scene?: string;
  direct?: { sun_angle?: number; footprint?: number };
  /** The scene's own lights, as FRAMES.json writes lights, and those that it has no light for. */
  scene_lights?: { name: string; light: Record<string, unknown>; note?: string }[];
  /** The text of their IES files, by the name that a light's `profile` has. */
  scene_profiles?: Record<string, string>;
  scene_lights_left_out?: { name: string; reason: string }[];
  asset_from_world?: Matrix4;
  sha256?: Record<string, string>;
  /** How the asset was made. Nothing depends on it but `receiverKind`, for assets that lack the key `receiver`. */
  source?: { receiver?: { kind?: string }; receivers?: { kind?: string }[] };
}

export function lightDomainOf(manifest: Manifest): LightDomain {
  return manifest.light_domain ?? "directions";
}

/** What is lit; undefined where the asset does not say. Assets of older versions say so under `source`. */
export function receiverKind(manifest: Manifest): ReceiverKind | undefined {
  const { receiver, receivers, source } = manifest;
  const first = receiver ?? receivers?.[0] ?? source?.receiver ?? source?.receivers?.[0];
  return first?.kind as ReceiverKind | undefined;
}

/** Whether the asset is a picture, a view or photographs, rather than a texture: `receiver_kind` of `srbf/relighting/alpha.py`. */
export function isPicture(manifest: Manifest): boolean {
  return (receiverKind(manifest) ?? "view") === "view";
}

/** Default source of receivers' positions in materials: a view has no mesh, so its position map. */
export function receiversFrom(manifest: Manifest): "map" | "vertex" {
  return receiverKind(manifest) === "view" ? "map" : "vertex";
}

/** `value` as a manifest. @throws SrbfError that names the key which breaks the schema. */
export function checkManifest(value: unknown, where: string): Manifest {
  const manifest = value as Manifest;
  const fail = (expected: string, found: unknown): never => {
    throw new SrbfError(`expected ${expected} in ${where}, found ${JSON.stringify(found) ?? "none"}; srbf fit and srbf export write it`);
  };
  if (typeof value !== "object" || value === null || manifest.format !== "srbf-asset") fail("format srbf-asset", manifest?.format);
  if (manifest.version !== 1) fail("version 1", manifest.version);
  const method = methodNamed(manifest.method) ?? fail(`a method of ${METHODS.map(({ name }) => name).join(", ")}`, manifest.method);
  if (manifest.quantity !== "irradiance" && manifest.quantity !== "radiance") fail("a quantity of irradiance, radiance", manifest.quantity);
  for (const side of ["width", "height"] as const) {
    if (!(Number.isInteger(manifest[side]) && manifest[side] >= 1)) fail(`${side} of at least 1`, manifest[side]);
  }
  const lights = lightDomainOf(manifest);
  if (!LIGHT_DOMAINS.includes(lights)) fail(`a light_domain of ${LIGHT_DOMAINS.join(", ")}`, lights);
  if (lights === "directions" && manifest.domain !== "sphere" && manifest.domain !== "hemisphere") fail("a domain of sphere, hemisphere", manifest.domain);
  const { receiver, receivers } = manifest;
  for (const one of [...(receiver === undefined ? [] : [receiver]), ...(receivers ?? [])]) {
    if (!RECEIVER_KINDS.includes(one?.kind)) fail(`a receiver of ${RECEIVER_KINDS.join(", ")}`, one?.kind);
  }
  const layers = layersOf(manifest);
  if (!Array.isArray(layers) || layers.length === 0) fail(method.layersKey, layers);
  const channels = method.layerChannels;
  for (const entry of layers) {
    if (!ENCODINGS.includes(entry.encoding)) fail(`an encoding of ${ENCODINGS.join(", ")}`, entry.encoding);
    if (entry.encoding !== layers[0].encoding) fail("one encoding for all layers", entry.encoding);
    if (entry.scale?.length !== channels || entry.bias?.length !== channels) fail(`scale and bias of ${channels} numbers`, entry.scale);
    if (typeof entry.file !== "string") fail("a file for each layer", entry.file);
  }
  method.check(manifest, layers.length, fail);
  return manifest;
}

/** The method of a checked manifest. */
export function methodOf(manifest: Manifest): Method {
  return methodNamed(manifest.method) as Method;
}

/** The stored layers: one RGB coefficient map each, or four scalar ones. */
export function layersOf(manifest: Manifest): LayerEntry[] {
  return (manifest as unknown as Record<string, LayerEntry[]>)[methodOf(manifest).layersKey];
}

/** `name` as a path inside the asset's folder. @throws SrbfError where it leaves it. */
export function insidePath(name: string): string {
  if (name === "" || name.startsWith("/") || name.includes("\\") || name.includes(":") || name.split("/").includes("..")) {
    throw new SrbfError(`expected a file inside the asset's folder, found ${JSON.stringify(name)}; do not trust this asset`);
  }
  return name.split("/").map(encodeURIComponent).join("/");
}
