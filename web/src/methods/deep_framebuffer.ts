/** Deep framebuffers: a view under any lights inside its scene, gathered from surfels by sparse links [Hasan2005]. */
import { SrbfError } from "../errors";
import { decodeFloat } from "../exr";
import type { AssetFiles } from "../files";
import { ACROSS, type Gather, gathered, type GatherManifest, NEAR_FILES, readGather, weightRows } from "../gather";
import { checkSize, type FloatImage, padToFour } from "../image";
import { LinkedLight } from "../linked_light";
import type { Triple } from "../matrix";
import { without } from "../near_sources";
import { decodePng } from "../png";
import shader from "../shaders/deep_framebuffer.glsl";
import { type Placed, placed } from "../surfels";
import type { Fail, Method, Tables } from "./method";

export const deepFramebuffer: Method = {
  name: "deep-framebuffer",
  layersKey: "neighbors",
  layerChannels: 3,
  mapsPerLayer: 1,
  mapsName: "neighbors",
  filterable: () => false, // a number of a cluster has no mean
  shader,

  check(manifest: GatherManifest, _layers: number, fail: Fail): void {
    for (const key of ["surfels", "clusters", "view_rays", "exchange_rays"] as const) {
      if (!(Number.isInteger(manifest.gather?.[key]) && (manifest.gather?.[key] as number) >= 1)) fail(`gather with ${key} of at least 1`, manifest.gather);
    }
    for (const key of ["pool", "view_links", "view_rows", "exchange_links", "exchange_rows"] as const) if (typeof manifest[key]?.file !== "string") fail(key, manifest[key]);
    if (manifest.behind_neighbors !== undefined && typeof manifest.behind_neighbors.file !== "string") fail("behind_neighbors", manifest.behind_neighbors);
    if (manifest.view_points !== undefined) for (const key of NEAR_FILES) if (typeof manifest[key]?.file !== "string") fail(`${key} beside view_points, which earlier versions did not write,`, manifest[key]);
    if (manifest.gather?.lobes !== undefined) {
      for (const key of ["lobes", "gloss_rays"] as const) if (!(Number.isInteger(manifest.gather[key]) && (manifest.gather[key] as number) >= 1)) fail(`gather with ${key} of at least 1`, manifest.gather);
      for (const key of ["gloss_links", "gloss_rows", "gloss_neighbors"] as const) if (typeof manifest[key]?.file !== "string") fail(key, manifest[key]);
      if (typeof manifest.glossy !== "string") fail("glossy, the reflectance of lobes", manifest.glossy);
    }
    if (manifest.behind_neighbors && typeof manifest.transmission !== "string") fail("transmission, what pixels let through", manifest.transmission);
    if (typeof manifest.scene !== "string") fail("a scene", manifest.scene);
    if (manifest.quantity === "radiance" && typeof manifest.albedo !== "string") fail("albedo of pixels", manifest.albedo);
  },

  async read(files: AssetFiles, manifest: GatherManifest & { free_places?: Triple[] }): Promise<Tables> {
    const { gloss_neighbors, glossy, behind_neighbors, transmission } = manifest;
    const [gather, srbfReflectance, lobes, behind, srbfGlossy, srbfThrough] = await Promise.all([
      readGather(files, manifest),
      readReflectance(files, manifest, manifest.quantity === "radiance" ? manifest.albedo : undefined),
      gloss_neighbors ? readNeighbors(files, manifest, gloss_neighbors.file) : [],
      behind_neighbors ? readNeighbors(files, manifest, behind_neighbors.file) : [],
      gloss_neighbors ? readReflectance(files, manifest, glossy) : undefined,
      behind_neighbors ? readReflectance(files, manifest, transmission) : undefined,
    ]);
    const layers = (manifest as unknown as { neighbors: unknown[] }).neighbors.length;
    const [rows, lobeRows] = weightRows(gather);
    lobes.forEach((layer) => renumber(layer, ACROSS * rows));
    // what pixels show beside diffuse reflection, of lobes and clusters that they mix in other ways
    const further = [
      { first: layers, count: lobes.length, name: "srbfGlossy" },
      { first: layers + lobes.length, count: behind.length, name: "srbfThrough" },
    ].filter(({ count }) => count > 0);
    return {
      centers: [],
      maps: layers,
      defines: {
        SRBF_LAYERS: layers,
        ...(lobes.length ? { SRBF_LOBE_LAYERS: lobes.length } : {}),
        ...(behind.length ? { SRBF_BEHIND_LAYERS: behind.length, SRBF_BEHIND_FIRST: layers + lobes.length } : {}),
      },
      furtherLayers: [...lobes, ...behind],
      vectors: {},
      integers: {},
      textures: { srbfReflectance, ...(srbfGlossy ? { srbfGlossy } : {}), ...(srbfThrough ? { srbfThrough } : {}) },
      weights: { kind: "texture", width: ACROSS, height: rows + lobeRows },
      places: manifest.free_places,
      projectsPunctual: true,
      gather,
      projectedWeights: projection(gather),
      sum(kit, uv) {
        const { float, int, ivec2, textureLoad, vec3 } = kit.tsl;
        const neighborLight = (first: number, count: number) => {
          const [total, share] = [vec3(0).toVar(), float(0).toVar()];
          kit.each(count, `k${first}`, (i) => {
            const own = kit.decoded(uv, i.add(first)).mul(255).add(0.5).floor().toVar();
            const cluster = int(own.x).add(int(own.y).mul(256)).toVar();
            total.addAssign(textureLoad(kit.texture("srbfWeights"), ivec2(cluster.mod(ACROSS), cluster.div(ACROSS))).rgb.mul(own.z));
            share.addAssign(own.z);
          });
          return total.div(share.max(1));
        };
        const at = srbfReflectance.width > 1 ? kit.texelAt(uv) : ivec2(0, 0);
        const diffuse = neighborLight(0, layers).mul(textureLoad(kit.texture("srbfReflectance"), at).rgb);
        return further.reduce((sum, { first, count, name }) => sum.add(neighborLight(first, count).mul(textureLoad(kit.texture(name), kit.texelAt(uv)).rgb)), diffuse);
      },
    };
  },
};

/** The irradiance of all clusters, and what lobes gather, by shadow rays; a light that has changed in color alone is not computed again. */
function projection(gather: Gather): Tables["projectedWeights"] {
  const received = new LinkedLight(gather.surfels);
  let known = new Map<string, Float64Array>(); // of white lights
  const white = (light: Placed): Float64Array => {
    const irradiance = received.under(light);
    const near = gather.near?.sources(irradiance, "position" in light ? light.position : undefined);
    return gathered(gather, irradiance, near && gather.near && { far: without(near, irradiance), sent: gather.near.irradiance(near, received.occluders) });
  };
  return (lights) => {
    if (lights.named.length) throw new SrbfError(`expected lights inside the scene for a deep framebuffer, found ${JSON.stringify(lights.named[0].name)}`);
    const [rows, lobeRows] = weightRows(gather);
    const out = new Float64Array(3 * ACROSS * (rows + lobeRows));
    const used = new Map<string, Float64Array>();
    for (const light of placed(lights)) {
      const key = JSON.stringify({ ...light, color: 1 });
      const own = known.get(key) ?? used.get(key) ?? white(light);
      used.set(key, own);
      own.forEach((x, i) => (out[i] += x * light.color[i % 3]));
    }
    known = used;
    return out;
  };
}

/** A reflectance / pi of all pixels, or one texel of 1 without. */
async function readReflectance(files: AssetFiles, manifest: GatherManifest, name: string | undefined): Promise<FloatImage> {
  if (name === undefined) return { kind: "float", width: 1, height: 1, channels: 4, data: new Float32Array(4).fill(1) };
  const image = checkSize(decodeFloat(await files.bytes(name), name), manifest, name);
  return { ...image, data: image.data.map((x) => x / Math.PI) };
}

/** Layers of neighbors, RGBA bytes, which lie below each other in a file. @throws SrbfError on one that does not hold whole pictures. */
async function readNeighbors(files: AssetFiles, { width, height }: GatherManifest, file: string): Promise<Uint8Array[]> {
  const image = decodePng(await files.bytes(file), file);
  if (image.width !== width || image.height % height) throw new SrbfError(`expected neighbors of ${width} x ${height} pixels in ${file}, found ${image.width} x ${image.height}; fit again`);
  const data = padToFour(image.data, image.channels);
  const size = 4 * width * height;
  return Array.from({ length: data.length / size }, (_, i) => data.subarray(i * size, (i + 1) * size));
}

/** Count the clusters of a layer from `first` on. */
function renumber(layer: Uint8Array, first: number): void {
  for (let at = 0; at < layer.length; at += 4) {
    const number = layer[at] + 256 * layer[at + 1] + first;
    layer[at] = number & 255;
    layer[at + 1] = number >> 8;
  }
}
