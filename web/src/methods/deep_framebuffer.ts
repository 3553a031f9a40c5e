/** Deep framebuffers: a view under any lights inside its scene, gathered from surfels by sparse links [Hasan2005]. */
import { SrbfError } from "../errors";
import { decodeFloat } from "../exr";
import type { AssetFiles } from "../files";
import { ACROSS, type Gather, gathered, type GatherManifest, readGather } from "../gather";
import { checkSize, type FloatImage } from "../image";
import { rgb } from "../light_values";
import type { Triple } from "../matrix";
import { without } from "../near_sources";
import { Occluders } from "../occluders";
import shader from "../shaders/deep_framebuffer.glsl";
import { type Placed, placed } from "../surfels";
import type { Fail, Method, Tables } from "./method";

const FAR = 1e4; // meters: how far a distant light's shadow rays go

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
    if (manifest.view_points !== undefined && typeof manifest.view_points.file !== "string") fail("view_points", manifest.view_points);
    if (typeof manifest.scene !== "string") fail("a scene", manifest.scene);
    if (manifest.quantity === "radiance" && typeof manifest.albedo !== "string") fail("albedo of pixels", manifest.albedo);
  },

  async read(files: AssetFiles, manifest: GatherManifest & { free_places?: Triple[] }): Promise<Tables> {
    const [gather, srbfReflectance] = await Promise.all([readGather(files, manifest), readReflectance(files, manifest)]);
    const layers = (manifest as unknown as { neighbors: unknown[] }).neighbors.length;
    return {
      centers: [],
      maps: layers,
      defines: { SRBF_LAYERS: layers },
      vectors: {},
      integers: {},
      textures: { srbfReflectance },
      weights: { kind: "texture", width: ACROSS, height: Math.ceil(gather.view.count / ACROSS) },
      places: manifest.free_places,
      projectsPunctual: true,
      gather,
      projectedWeights: projection(gather),
      sum(kit, uv) {
        const { float, int, ivec2, textureLoad, vec3 } = kit.tsl;
        const [total, share] = [vec3(0).toVar(), float(0).toVar()];
        kit.each(layers, "k", (i) => {
          const own = kit.decoded(uv, i).mul(255).add(0.5).floor().toVar();
          const cluster = int(own.x).add(int(own.y).mul(256)).toVar();
          total.addAssign(textureLoad(kit.texture("srbfWeights"), ivec2(cluster.mod(ACROSS), cluster.div(ACROSS))).rgb.mul(own.z));
          share.addAssign(own.z);
        });
        const at = srbfReflectance.width > 1 ? kit.texelAt(uv) : ivec2(0, 0);
        return total.div(share.max(1)).mul(textureLoad(kit.texture("srbfReflectance"), at).rgb);
      },
    };
  },
};

/** The irradiance of all clusters by shadow rays; a light that has changed in color alone is not computed again. */
function projection(gather: Gather): Tables["projectedWeights"] {
  const { cells, corners } = gather.surfels;
  let occluders: Occluders | undefined;
  let known = new Map<string, Float64Array>(); // of white lights
  const white = (light: Placed): Float64Array => {
    occluders ??= new Occluders(corners);
    const received = light.kind === "area" ? cells.underArea(light, occluders) : light.kind === "directional" ? cells.underDistant(light.direction, occluders, FAR) : cells.underPoint(light, occluders);
    const irradiance = rgb(received, cells.count);
    const distant = light.kind === "directional";
    const near = gather.near?.sources(irradiance, { place: distant ? light.direction : light.position, distant });
    return near ? gathered(gather, without(near, irradiance), gather.near?.irradiance(near, occluders)) : gathered(gather, irradiance);
  };
  return (lights) => {
    if (lights.named.length) throw new SrbfError(`expected lights inside the scene for a deep framebuffer, found ${JSON.stringify(lights.named[0].name)}`);
    const out = new Float64Array(3 * ACROSS * Math.ceil(gather.view.count / ACROSS));
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

/** Albedo / pi of all pixels, or one texel of 1 for irradiance. */
async function readReflectance(files: AssetFiles, manifest: GatherManifest): Promise<FloatImage> {
  if (manifest.quantity === "irradiance") return { kind: "float", width: 1, height: 1, channels: 4, data: new Float32Array(4).fill(1) };
  const name = manifest.albedo as string;
  const image = checkSize(decodeFloat(await files.bytes(name), name), manifest, name);
  return { ...image, data: image.data.map((x) => x / Math.PI) };
}
