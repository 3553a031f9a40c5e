/** What the page loads before it shows anything, and its progress. */
import type { BufferGeometry, Material, Mesh, Object3D, WebGLRenderer } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { type Asset, type FloatImage, lightDomainOf, loadAsset, type Manifest, Profile, SrbfError } from "../src";
import { decodeFloat } from "../src/exr";
import { fetched } from "../src/files";
import { insidePath } from "../src/manifest";
import type { CyclesFacts } from "./cycles";
import type { DirectInputs, ViewCamera } from "./direct_light";
import { type Environment, exrEnvironment } from "./environment_file";
import type { FittedCamera } from "./frames";
import { References } from "./reference";

/** One asset, as `srbf/viewer/page_manifest.py` describes it. */
export interface AssetFacts {
  name: string;
  folder: string;
  resident_bytes: number;
  bytes_per_texel: number;
  spectrum: string;
  errors: string | null;
  /** The table of `srbf.microfacets.albedo_table`, of views with gloss. */
  lobe_albedo?: string;
  /** Tables of `srbf.light_profile.Profile`, by the names that lights have for them, and whether they are images. */
  profiles?: Record<string, { file: string; projected: boolean }>;
}

/** viewer.json: `srbf/viewer/page_manifest.py`. */
export interface Facts {
  title: string;
  assets: AssetFacts[];
  kind: "view" | "lightmap";
  mesh: string | null;
  capture: string | null;
  /** Folder of an asset of probes. */
  probes: string | null;
  camera: FittedCamera | null;
  /** Where the page may ask for renders. */
  cycles?: CyclesFacts | null;
  /** Where environment maps are, by their names; the first one shines. */
  environments?: Record<string, string>;
  notes: string[];
}

/** An asset with what only the page needs of it. */
export interface LoadedAsset {
  facts: AssetFacts;
  asset: Asset;
  coverage?: FloatImage;
  /** For an indirect asset whose direct light can be added. */
  direct?: DirectInputs;
  /** By the names that lights have for them. */
  profiles: ReadonlyMap<string, Profile>;
}

export interface Loaded {
  facts: Facts;
  first: LoadedAsset;
  model?: Object3D;
  references?: References;
  /** What lights the sphere that moves. */
  probes?: Asset;
  environments: ReadonlyMap<string, Environment>;
  notes: string[];
}

type Fetcher = (url: string) => Promise<Response>;

/** Reads viewer.json. @throws SrbfError where it is missing. */
export async function loadFacts(): Promise<Facts> {
  const facts: Facts = await (await fetched(fetch.bind(window), "viewer.json")).json();
  document.title = `${facts.title} · srbf`;
  return facts;
}

/** @throws SrbfError in one line where a file is missing or damaged. */
export async function load(facts: Facts, index: number, progress: (done: number, what: string) => void): Promise<Loaded> {
  const notes = [...facts.notes];
  const maps = Object.entries(facts.environments ?? {}).map(async ([name, url]) => [name, exrEnvironment(await (await fetched(fetch.bind(window), url)).arrayBuffer(), name)] as const);
  const [first, model, references, probes, environments] = await Promise.all([
    loadOne(facts.assets[index], progress),
    facts.mesh ? readModel(facts.mesh, notes) : undefined,
    facts.capture ? References.load(facts.capture) : undefined,
    facts.probes ? loadAsset(facts.probes, { verify: globalThis.isSecureContext, exact: true }) : undefined,
    Promise.all(maps),
  ]);
  progress(1, "");
  return { facts, first, model, references, probes, environments: new Map(environments), notes };
}

/** One of the assets. @throws SrbfError as `load`. */
export async function loadOne(facts: AssetFacts, progress: (done: number, what: string) => void): Promise<LoadedAsset> {
  let total = 2;
  let done = 0;
  const counting = async (url: string) => {
    const response = await fetch(url);
    if (url.endsWith("asset.json") && response.ok) {
      const manifest = await response.clone().json().catch(() => ({}));
      total = 2 + Object.keys(manifest.sha256 ?? {}).length;
    }
    const body = await response.arrayBuffer();
    progress(++done / Math.max(done, total), url);
    return new Response(body, { status: response.status });
  };
  const asset = await loadAsset(facts.folder, { fetch: counting, verify: globalThis.isSecureContext, exact: true });
  const { coverage: name } = asset.manifest;
  const coverage = name === undefined ? undefined : await readImage(facts.folder, name, counting);
  const table = (url: string) => fetched(counting, url).then(async (response) => decodeFloat(await response.arrayBuffer(), url));
  const profiled = Object.entries(facts.profiles ?? {}).map(async ([own, { file, projected }]) => [own, new Profile(await table(file), projected)] as const);
  const [profiles, direct] = await Promise.all([Promise.all(profiled), readDirect(asset, coverage, facts.folder, counting)]);
  if (direct) Object.assign(direct, await readLobes(asset, facts, counting, table));
  return { facts, asset, coverage, direct, profiles: new Map(profiles) };
}

/** What direct light needs of a view's gloss, and of what it lets through. */
async function readLobes({ manifest }: Asset, facts: AssetFacts, fetcher: Fetcher, table: (url: string) => Promise<FloatImage>): Promise<Partial<DirectInputs>> {
  const { glossy, lobe, transmission, direct, quantity } = manifest as Manifest & { glossy?: string; lobe?: string; transmission?: string; direct?: { camera?: ViewCamera } };
  const own = (name: string) => readImage(facts.folder, name, fetcher);
  const through = transmission && quantity === "radiance" ? await own(transmission) : undefined;
  const camera = direct?.camera;
  if (!glossy || !lobe || !camera || !facts.lobe_albedo) return { through };
  const [colors, lobes, albedo] = await Promise.all([own(glossy), own(lobe), table(facts.lobe_albedo)]);
  return { through, gloss: { glossy: colors, lobe: lobes, table: albedo, camera } };
}

async function readImage(folder: string, name: string, fetcher: Fetcher): Promise<FloatImage> {
  const url = folder + insidePath(name);
  return decodeFloat(await (await fetched(fetcher, url)).arrayBuffer(), url);
}

/** Undefined for combined assets, for named lights, and for indirect ones that lack what direct light needs. */
async function readDirect(asset: Asset, coverage: FloatImage | undefined, folder: string, fetcher: Fetcher): Promise<DirectInputs | undefined> {
  const { transport, scene, normal, albedo, quantity } = asset.manifest;
  if (transport !== "indirect" || lightDomainOf(asset.manifest) === "named" || !scene || !normal || !asset.position || (quantity === "radiance" && !albedo)) return undefined;
  const [normals, colors, casters] = await Promise.all([
    readImage(folder, normal, fetcher),
    quantity === "radiance" && albedo ? readImage(folder, albedo, fetcher) : undefined,
    fetched(fetcher, folder + insidePath(scene))
      .then((response) => response.arrayBuffer())
      .then((buffer) => new GLTFLoader().parseAsync(buffer, "")),
  ]);
  return { normal: normals, coverage, albedo: colors, scene: casters.scene };
}

async function readModel(url: string, notes: string[]): Promise<Object3D | undefined> {
  try {
    const gltf = await new GLTFLoader().loadAsync(url);
    gltf.scene.userData.cameras = gltf.cameras;
    const surfaces: Promise<void>[] = [];
    gltf.scene.traverse((object) => {
      const { material, userData } = object as Mesh<BufferGeometry, Material>;
      const surface = material?.userData.gltfExtensions?.SRBF_relighting_map?.surface;
      if (surface === undefined) return;
      surfaces.push(gltf.parser.getDependency("material", surface).then((found) => void (userData.surface = found)));
    });
    await Promise.all(surfaces);
    return gltf.scene;
  } catch (error) {
    notes.push(`cannot read ${url}: ${error instanceof Error ? error.message : String(error)}; the texels are shown`);
    return undefined;
  }
}

/** @throws SrbfError where the GPU cannot draw floats. */
export function checkGpu(renderer: WebGLRenderer): void {
  if (!renderer.extensions.has("EXT_color_buffer_float") && !renderer.extensions.has("EXT_color_buffer_half_float")) {
    throw new SrbfError("expected a GPU that draws into floating-point textures, found one without; use another browser or machine");
  }
}
