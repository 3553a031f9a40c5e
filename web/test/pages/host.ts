/** Jobs without a GPU: what the core computes and decodes. */
import { frameValues, loadAsset } from "../../src";
import { projectedWeights } from "../../src/weights";
import { type Job, lightOfJson, type LightJson } from "./job";

/** Projected weights in double precision, and the point lights' uniforms; `raw` lights are written by hand. */
export async function host(job: Job) {
  const asset = await loadAsset(job.asset, { verify: true, exact: job.exact === true });
  const lights = [...job.lights, ...((job.raw as LightJson[]) ?? [])].map(lightOfJson);
  return { weights: [...projectedWeights(asset, lights)], pointLights: frameValues(asset, lights).pointLights };
}

/** The layers as they were decoded, level after level. */
export async function layers(job: Job) {
  const asset = await loadAsset(job.asset);
  return { levels: asset.layers.levels.map((level) => [...level]), encoding: asset.layers.encoding };
}

/** Load with checksums compared. */
export async function load(job: Job) {
  await loadAsset(job.asset, { verify: true });
  return {};
}
