/** asset.json, format srbf-asset, version 1: what is read of it, and the checks. Keys that are not known are ignored, unknown versions refused. */
import { SrbfError } from "./errors";
import type { Matrix4, Triple } from "./matrix";

export type Method = "relighting-map" | "eigen-map" | "clustered-eigen-map";
export type Encoding = "half" | "float" | "uint8" | "bc7" | "bc1";

export const METHODS: readonly Method[] = ["relighting-map", "eigen-map", "clustered-eigen-map"];
const ENCODINGS: readonly Encoding[] = ["half", "float", "uint8", "bc7", "bc1"];

/** A stored layer: value = stored * scale + bias, three channels of a relighting map, four of scalar planes. */
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

export interface Manifest {
  format: "srbf-asset";
  version: 1;
  method: Method;
  quantity: "irradiance" | "radiance";
  transport?: "combined" | "indirect";
  width: number;
  height: number;
  domain: "sphere" | "hemisphere";
  basis?: { kind: string; centers?: Triple[]; spread?: number };
  maps?: LayerEntry[];
  r_table?: { file: string; size: number };
  scalars?: number;
  clusters?: number;
  planes?: LayerEntry[];
  light_basis?: { kind: string; centers: Triple[]; spreads: number[] };
  light_coefficients?: { file: string };
  w_table?: { file: string; size: number; columns: number };
  cluster_index?: { file: string };
  position?: string;
  normal?: string;
  coverage?: string;
  ambient?: string;
  albedo?: string;
  /** The .glb of what casts, of indirect assets. */
  scene?: string;
  direct?: { sun_angle?: number; footprint?: number };
  asset_from_world?: Matrix4;
  sha256?: Record<string, string>;
  source?: { receiver?: { kind?: string }; receivers?: { kind?: string }[] };
}

/** Whether the asset is a picture, a view or photographs, rather than a texture: `receiver_kind` of `srbf/relighting/alpha.py`. */
export function isPicture(manifest: Manifest): boolean {
  const { receiver, receivers } = manifest.source ?? {};
  return ((receiver ?? receivers?.[0])?.kind ?? "view") === "view";
}

/** `value` as a manifest. @throws SrbfError that names the key which is not as the schema says. */
export function checkManifest(value: unknown, where: string): Manifest {
  const manifest = value as Manifest;
  const fail = (expected: string, found: unknown): never => {
    throw new SrbfError(`expected ${expected} in ${where}, found ${JSON.stringify(found) ?? "none"}; srbf fit and srbf export make one`);
  };
  if (typeof value !== "object" || value === null || manifest.format !== "srbf-asset") fail("format srbf-asset", manifest?.format);
  if (manifest.version !== 1) fail("version 1", manifest.version);
  if (!METHODS.includes(manifest.method)) fail(`a method of ${METHODS.join(", ")}`, manifest.method);
  if (manifest.quantity !== "irradiance" && manifest.quantity !== "radiance") fail("a quantity of irradiance, radiance", manifest.quantity);
  for (const side of ["width", "height"] as const) {
    if (!(Number.isInteger(manifest[side]) && manifest[side] >= 1)) fail(`${side} of at least 1`, manifest[side]);
  }
  if (manifest.domain !== "sphere" && manifest.domain !== "hemisphere") fail("a domain of sphere, hemisphere", manifest.domain);
  const layers = layersOf(manifest);
  if (!Array.isArray(layers) || layers.length === 0) fail(manifest.method === "relighting-map" ? "maps" : "planes", layers);
  const channels = manifest.method === "relighting-map" ? 3 : 4;
  for (const entry of layers) {
    if (!ENCODINGS.includes(entry.encoding)) fail(`an encoding of ${ENCODINGS.join(", ")}`, entry.encoding);
    if (entry.encoding !== layers[0].encoding) fail("one encoding for all layers", entry.encoding);
    if (entry.scale?.length !== channels || entry.bias?.length !== channels) fail(`scale and bias of ${channels} numbers`, entry.scale);
    if (typeof entry.file !== "string") fail("a file for each layer", entry.file);
  }
  if (manifest.method === "relighting-map") {
    if (manifest.basis?.kind !== "gaussian") fail("maps of Gaussians", manifest.basis?.kind);
    if (manifest.basis?.centers?.length !== layers.length) fail("as many centers as maps", manifest.basis?.centers?.length);
    if (!manifest.r_table) fail("an r_table", undefined);
  } else {
    if (!(Number.isInteger(manifest.scalars) && Math.ceil((manifest.scalars as number) / 4) === layers.length)) {
      fail("scalars four to an image", manifest.scalars);
    }
    const functions = (manifest.clusters ?? 1) * ((manifest.scalars as number) + 1);
    if (manifest.light_basis?.spreads.length !== functions) fail(`a spread for each of ${functions} light functions`, manifest.light_basis?.spreads.length);
    if (!manifest.light_coefficients) fail("light_coefficients", undefined);
    if (!manifest.w_table) fail("a w_table", undefined);
    if (manifest.method === "clustered-eigen-map" && !manifest.cluster_index) fail("a cluster_index", undefined);
  }
  return manifest;
}

/** The stored layers: maps, or images of four planes. */
export function layersOf(manifest: Manifest): LayerEntry[] {
  return (manifest.method === "relighting-map" ? manifest.maps : manifest.planes) as LayerEntry[];
}

/** `name` as a path inside the asset's folder. @throws SrbfError where it leaves it. */
export function insidePath(name: string): string {
  if (name === "" || name.startsWith("/") || name.includes("\\") || name.includes(":") || name.split("/").includes("..")) {
    throw new SrbfError(`expected a file inside the asset's folder, found ${JSON.stringify(name)}; do not trust this asset`);
  }
  return name.split("/").map(encodeURIComponent).join("/");
}
