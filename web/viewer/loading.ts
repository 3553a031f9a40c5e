/** What the page reads before it shows anything, and how far it is. */
import { type Object3D, type WebGLRenderer } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { type Asset, type FloatImage, loadAsset, SrbfError } from "../src";
import { decodeFloat } from "../src/exr";
import { fetched } from "../src/files";
import { insidePath } from "../src/manifest";
import type { FittedCamera } from "./frames";
import { References } from "./reference";

/** viewer.json: `srbf/viewer/facts.py`. */
export interface Facts {
  title: string;
  asset: string;
  kind: "view" | "lightmap";
  mesh: string | null;
  capture: string | null;
  camera: FittedCamera | null;
  resident_bytes: number;
  notes: string[];
}

export interface Loaded {
  facts: Facts;
  asset: Asset;
  coverage?: FloatImage;
  model?: Object3D;
  references?: References;
  notes: string[];
}

/** @throws SrbfError in one line where anything that is needed is missing or damaged. */
export async function load(progress: (done: number, what: string) => void): Promise<Loaded> {
  const facts: Facts = await (await fetched(fetch.bind(window), "viewer.json")).json();
  document.title = `${facts.title} · srbf`;
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
  const asset = await loadAsset(facts.asset, { fetch: counting, verify: globalThis.isSecureContext });
  const notes = [...facts.notes];
  const [coverage, model, references] = await Promise.all([
    readCoverage(asset, facts.asset, counting),
    facts.mesh ? readModel(facts.mesh, notes) : undefined,
    facts.capture ? References.load(facts.capture) : undefined,
  ]);
  progress(1, "");
  return { facts, asset, coverage, model, references, notes };
}

async function readCoverage(asset: Asset, folder: string, fetcher: (url: string) => Promise<Response>): Promise<FloatImage | undefined> {
  const name = asset.manifest.coverage;
  if (name === undefined) return undefined;
  const url = folder + insidePath(name);
  return decodeFloat(await (await fetched(fetcher, url)).arrayBuffer(), url);
}

async function readModel(url: string, notes: string[]): Promise<Object3D | undefined> {
  try {
    return (await new GLTFLoader().loadAsync(url)).scene;
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
