/** Runs jobs one after the other; every job makes what it needs and disposes of it. */
import { babylonMaterial } from "./babylon";
import { host, layers, load } from "./host";
import type { Job } from "./job";
import { playcanvasMaterial } from "./playcanvas";
import { nodesLightmap, nodesMaterial, nodesProbes, nodesShadows } from "./three_nodes";
import { threeGltf, threeLightmap, threeMaterial, threeProbes, threeShadows } from "./three_webgl";

const RUNS: Record<string, (job: Job) => Promise<unknown>> = {
  "babylon-material": babylonMaterial,
  host,
  layers,
  load,
  "playcanvas-material": playcanvasMaterial,
  "nodes-lightmap": nodesLightmap,
  "nodes-material": nodesMaterial,
  "nodes-probes": nodesProbes,
  "nodes-shadows": nodesShadows,
  "three-gltf": threeGltf,
  "three-lightmap": threeLightmap,
  "three-material": threeMaterial,
  "three-probes": threeProbes,
  "three-shadows": threeShadows,
};

declare global {
  interface Window {
    runJob?: (job: Job) => Promise<unknown>;
  }
}

window.runJob = async (job) => {
  try {
    return await RUNS[job.run](job);
  } catch (error) {
    return { error: error instanceof Error ? `${error.name}: ${error.message}` : String(error) };
  }
};
