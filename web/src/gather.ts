/** The links of a deep framebuffer, and the light that they carry: `srbf/visibility/packed_links.py` and `sparse_links.py`. */
import { SrbfError } from "./errors";
import { decodeFloat } from "./exr";
import type { AssetFiles } from "./files";
import { type ByteImage, type FloatImage, padToFour } from "./image";
import { LinkedObjects } from "./light_linking";
import type { Manifest } from "./manifest";
import { NearCells } from "./near_cells";
import { NearPool } from "./near_sources";
import { decodePng } from "./png";
import { Cells } from "./received_light";
import type { Surfels } from "./surfels";
import { readOccluders } from "./triangles";

/** Keys of asset.json. */
export interface GatherManifest extends Manifest {
  gather?: {
    surfels: number;
    clusters: number;
    view_rays: number;
    exchange_rays: number;
    bounces?: number;
    lobes?: number;
    gloss_rays?: number;
    specular_albedo?: boolean;
    /** Names of objects, of which the pool has each surfel's number. */
    objects?: string[];
  };
  pool?: { file: string };
  view_links?: { file: string };
  view_rows?: { file: string };
  exchange_links?: { file: string };
  exchange_rows?: { file: string };
  /** Places and normals of the view's clusters, and cells by which near surfels are seen: without, all light comes by links. */
  view_points?: { file: string };
  near_labels?: { file: string };
  near_places?: { file: string };
  /** Of a view with specular lobes: links of these, and the lobes of its pixels. */
  gloss_links?: { file: string };
  gloss_rows?: { file: string };
  gloss_neighbors?: { file: string };
  /** The clusters behind pixels that let light through. */
  behind_neighbors?: { file: string };
  /** Reflectance of the pixels' lobes, and what they let through. */
  glossy?: string;
  transmission?: string;
}

/** Sparse links of `count` rows, as the shader pack's `srbfLinkedLight` takes them. */
export interface PackedLinks {
  readonly count: number;
  /** RGBA bytes: low and high byte of a surfel, how many of the row's rays meet it. */
  readonly links: ByteImage;
  /** Column and row of each row's first link, how many it has; `ACROSS` rows next to each other. */
  readonly rows: FloatImage;
  /** Rays of a row. */
  readonly rays: number;
}

export interface Gather {
  /** A cell and a patch for each surfel. */
  readonly surfels: Surfels;
  /** (S, 3). */
  readonly albedo: Float32Array;
  readonly exchange: PackedLinks;
  readonly view: PackedLinks;
  /** Specular lobes of the view's pixels, where it has any. */
  readonly gloss?: PackedLinks;
  /** What lobes see surfels reflect beside their albedo, (S, 3). */
  readonly specular?: Float32Array;
  /** Bounces that are added up. */
  readonly terms: number;
  /** What bright surfels light in closed form. */
  readonly near?: NearPool;
}

export const NEAR_FILES = ["view_points", "near_labels", "near_places"] as const;
export const ACROSS = 256; // rows, or clusters, next to each other in a texture
const [NEGLIGIBLE, MOST_TERMS] = [1e-4, 64]; // of all light, that a bounce adds and is the last; of a scene whose bounces nobody has limited

/** A part of the light that the brightest surfels send in closed form. */
export interface NearLight {
  /** Irradiance on the surfels without its part on the bright ones, (S, 3). */
  readonly far: Float64Array;
  /** What that part lays on the clusters and, after these, on the surfels, which has been reflected once already. */
  readonly sent: Float64Array;
}

/** Rows of ACROSS texels that the irradiance of the clusters fills, and those after them that what lobes gather fills. */
export function weightRows({ view, gloss }: Gather): [clusters: number, lobes: number] {
  return [Math.ceil(view.count / ACROSS), Math.ceil((gloss?.count ?? 0) / ACROSS)];
}

/** @throws SrbfError on damaged files, and on links that do not fit the pool. */
export async function readGather(files: AssetFiles, manifest: GatherManifest): Promise<Gather> {
  const { surfels, clusters, view_rays, exchange_rays, bounces, lobes, gloss_rays, specular_albedo, objects: names } = manifest.gather as Required<GatherManifest>["gather"];
  const file = (manifest.pool as { file: string }).file;
  const scene = manifest.scene as string;
  const float = (name: string) => files.bytes(name).then((buffer) => decodeFloat(buffer, name));
  const [pool, triangles, view, exchange, near, gloss] = await Promise.all([
    float(file),
    files.bytes(scene).then((buffer) => readOccluders(buffer, scene)),
    readLinks(files, manifest, "view", clusters, view_rays, surfels),
    readLinks(files, manifest, "exchange", surfels, exchange_rays, surfels),
    manifest.view_points && Promise.all(NEAR_FILES.map((key) => float((manifest[key] as { file: string }).file))),
    lobes ? readLinks(files, manifest, "gloss", lobes, gloss_rays as number, surfels) : undefined,
  ]);
  const least = specular_albedo ? 4 : 3;
  if (pool.width !== surfels || pool.height < least) throw new SrbfError(`expected ${surfels} x ${least} numbers in ${file}, found ${pool.width} x ${pool.height}`);
  const first = pool.data.slice(0, 8 * surfels);
  for (let i = 0; i < surfels; ++i) first[4 * (surfels + i) + 3] = i;
  const colors = (row: number) => Float32Array.from({ length: 3 * surfels }, (_, i) => pool.data[4 * (row * surfels + Math.floor(i / 3)) + (i % 3)]);
  const albedo = colors(2);
  const objects = names?.length ? new LinkedObjects({ names, objects: surfelObjects(pool, surfels, names.length, file) }, triangles) : undefined;
  const specular = specular_albedo ? colors(3) : undefined;
  const cells = new Cells({ kind: "float", width: surfels, height: 2, channels: 4, data: first }, file);
  const most = bounces ?? MOST_TERMS;
  const terms = Math.max(termsOf(exchange, albedo, most), Math.min(specular ? 1 : 0, most)); // lobes see what is not diffuse
  return { surfels: { cells, corners: triangles.corners, objects, tables: [] }, albedo, exchange, view, gloss, specular, terms, near: near && terms ? nearPool(near) : undefined };

  function nearPool([points, labels, places]: FloatImage[]): NearPool {
    return new NearPool(cells, new NearCells(labels, places, surfels, "near_labels"), albedo, points, clusters, "view_points");
  }
}

/** @throws SrbfError where a number has no name. */
function surfelObjects({ data }: FloatImage, surfels: number, count: number, where: string): Int32Array {
  const objects = Int32Array.from({ length: surfels }, (_, i) => Math.round(data[4 * (2 * surfels + i) + 3]));
  const other = objects.find((object) => !(object >= 0 && object < count));
  if (other !== undefined) throw new SrbfError(`expected objects 0 to ${count - 1} in ${where}, found ${other}; fit again`);
  return objects;
}

/** What the clusters and, from the next row of ACROSS on, the lobes receive from surfels of a direct irradiance (S, 3), all bounces included. */
export function gathered(gather: Gather, irradiance: Float64Array, near?: NearLight): Float64Array {
  const { exchange, view, gloss, albedo, specular, terms } = gather;
  const [far, own] = [near?.far ?? irradiance, near?.sent.subarray(3 * view.count)];
  let radiosity = new Float64Array(irradiance.length);
  for (let term = 0; term < terms; ++term) {
    const arriving = term ? linked(exchange, radiosity) : radiosity;
    radiosity = far.map((direct, i) => albedo[i] * (direct + arriving[i] + (term && own ? own[i] : 0)));
  }
  const [rows, lobeRows] = weightRows(gather);
  const out = new Float64Array(3 * ACROSS * (rows + lobeRows));
  linked(view, radiosity).forEach((x, i) => (out[i] = x + (near ? near.sent[i] : 0)));
  if (!gloss) return out;
  const seen = radiosity.map((x, i) => x + albedo[i] * (irradiance[i] - far[i]));
  if (specular && terms) linked(exchange, radiosity).forEach((x, i) => (seen[i] += specular[i] * (irradiance[i] + x + (own ? own[i] : 0))));
  out.set(linked(gloss, seen), 3 * ACROSS * rows);
  return out;
}

/** Light along links, (count, 3) from (S, 3): `srbfLinkedLight` of every row. */
export function linked({ count, links, rows, rays }: PackedLinks, light: Float64Array): Float64Array {
  const out = new Float64Array(3 * count);
  for (let row = 0; row < count; ++row) {
    let at = 4 * (rows.data[4 * row + 1] * links.width + rows.data[4 * row]);
    for (const end = at + 4 * rows.data[4 * row + 2]; at < end; at += 4) {
      const surfel = 3 * (links.data[at] + 256 * links.data[at + 1]);
      const share = links.data[at + 2] / rays;
      for (let c = 0; c < 3; ++c) out[3 * row + c] += share * light[surfel + c];
    }
  }
  return out;
}

function termsOf(exchange: PackedLinks, albedo: Float32Array, most: number): number {
  let last = Float64Array.from(albedo);
  let total = 0;
  for (let term = 0; term < most; ++term) {
    const part = last.reduce((sum, x) => sum + x, 0);
    total += part;
    if (part <= NEGLIGIBLE * total) return term;
    last = linked(exchange, last).map((x, i) => albedo[i] * x);
  }
  return most;
}

async function readLinks(files: AssetFiles, manifest: GatherManifest, name: "view" | "exchange" | "gloss", count: number, rays: number, surfels: number): Promise<PackedLinks> {
  const of = async (part: "links" | "rows") => {
    const { file } = manifest[`${name}_${part}`] as { file: string };
    return decodePng(await files.bytes(file), file);
  };
  const [image, sizes] = await Promise.all([of("links"), of("rows")]);
  const rows = new Float32Array(4 * ACROSS * Math.ceil(count / ACROSS));
  let first = 0;
  for (let i = 0; i < count; ++i) {
    const size = sizes.data[sizes.channels * i] + 256 * sizes.data[sizes.channels * i + 1];
    rows.set([first % image.width, Math.floor(first / image.width), size], 4 * i);
    first += size;
  }
  const data = padToFour(image.data, image.channels);
  let largest = 0;
  for (let i = 0; i < first; ++i) largest = Math.max(largest, data[4 * i] + 256 * data[4 * i + 1]);
  if (!(first <= image.width * image.height) || largest >= surfels) throw new SrbfError(`expected ${name} links of ${count} rows to ${surfels} surfels, found others; fit again`);
  return {
    count,
    links: { kind: "uint8", width: image.width, height: image.height, channels: 4, data },
    rows: { kind: "float", width: ACROSS, height: rows.length / (4 * ACROSS), channels: 4, data: rows },
    rays,
  };
}
