/** Neural maps: a learned code per texel, decoded with the light's direction by one small network for the whole asset [Dulecha2020]. */
import type { DistantLight } from "../asset_frame";
import { environmentSamples, mapFrame } from "../environment";
import { SrbfError } from "../errors";
import { decodeFloat } from "../exr";
import type { AssetFiles } from "../files";
import type { EnvironmentLight } from "../lights";
import type { Manifest } from "../manifest";
import { dot, type Matrix4, type Triple } from "../matrix";
import shader from "../shaders/neural_map.glsl";
import type { N } from "../three/tsl/nodes";
import type { Fail, Method, Tables } from "./method";
import type { NodeKit } from "./node_kit";

/** Keys of asset.json that this method adds. */
interface NeuralManifest extends Manifest {
  /** Numbers of a code. */
  scalars?: number;
  network?: { file: string; hidden: number };
}

const NODES = 256; // directions that an environment is seen from
const MOST_DISTANT = 512;
const MOST_HIDDEN = 32;

export const neuralMap: Method = {
  name: "neural-map",
  layersKey: "planes",
  layerChannels: 4,
  mapsPerLayer: 4,
  mapsName: "numbers per code",
  filterable: () => false, // the light of a mean of codes is no mean of light
  shader,

  check({ scalars, network }: NeuralManifest, layers: number, fail: Fail): void {
    if (!(Number.isInteger(scalars) && Math.ceil((scalars as number) / 4) === layers)) fail("scalars four to an image", scalars);
    const hidden = network?.hidden as number;
    if (!(hidden >= 4 && hidden <= MOST_HIDDEN && hidden % 4 === 0)) fail(`a network of a multiple of 4 hidden units up to ${MOST_HIDDEN}`, network);
  },

  async read(files: AssetFiles, manifest: NeuralManifest): Promise<Tables> {
    const { file, hidden } = manifest.network as { file: string; hidden: number };
    const codes = manifest.scalars as number;
    const network = decodeFloat(await files.bytes(file), file);
    const rows = codes + hidden + 9;
    if (network.width !== hidden || network.height !== rows || network.channels !== 1) {
      throw new SrbfError(`expected a network of ${hidden} x ${rows} numbers in ${file}, found ${network.width} x ${network.height} x ${network.channels}`);
    }
    const vectors = network.data.slice(0, (rows - 1) * hidden + 4); // the last row holds three numbers
    const around = new EnvironmentNodes(manifest.domain);
    return {
      centers: [],
      maps: codes,
      defines: { SRBF_COMPONENTS: codes, SRBF_LAYERS: Math.ceil(codes / 4), SRBF_UNIT_VECTORS: hidden / 4, SRBF_NETWORK: vectors.length / 4 },
      vectors: { srbfNetwork: vectors },
      integers: {},
      textures: {},
      weights: { kind: "texture", width: MOST_DISTANT, height: 2 },
      projectedWeights: ({ distant, environments, assetFromWorld }) => distantLights([...distant, ...environments.flatMap((light) => around.lights(light, assetFromWorld))]),
      sum: (kit, uv, receiver) => sum(kit, codes, hidden / 4, uv, receiver),
    };
  },
};

/** A row of unit directions, then one of colors, of the lights at infinity that shine; zeros after them. */
function distantLights(lights: readonly DistantLight[]): Float64Array {
  const shining = lights.filter(([, color]) => color.some((x) => x !== 0));
  if (shining.length > MOST_DISTANT) {
    throw new SrbfError(`expected at most ${MOST_DISTANT} lights at infinity for a neural map, environments as ${NODES}, found ${shining.length}; relight it by fewer`);
  }
  const out = new Float64Array(6 * MOST_DISTANT);
  shining.forEach(([direction, color], i) => {
    out.set(direction, 3 * i);
    out.set(color, 3 * (MOST_DISTANT + i));
  });
  return out;
}

/** Environments as NODES lights at infinity, each for the texels that it is nearest to: of the Fibonacci lattice, or the upper half of one. */
class EnvironmentNodes {
  private readonly nodes: readonly Triple[];
  private readonly maps = new WeakMap<object, { frame: string; shone: DistantLight[] }>(); // by their pixels: what was gathered last, in white

  constructor(private readonly region: "sphere" | "hemisphere") {
    const whole = region === "sphere" ? NODES : 2 * NODES;
    this.nodes = Array.from({ length: NODES }, (_, i) => {
      const z = 1 - (2 * i + 1) / whole;
      const azimuth = Math.PI * (3 - Math.sqrt(5)) * i;
      const r = Math.sqrt(1 - z * z);
      return [r * Math.cos(azimuth), r * Math.sin(azimuth), z];
    });
  }

  lights(light: EnvironmentLight, assetFromWorld: Matrix4): DistantLight[] {
    const frame = String(mapFrame(light, assetFromWorld));
    const known = this.maps.get(light.pixels as object);
    const shone = known?.frame === frame ? known.shone : this.gathered(light, assetFromWorld);
    this.maps.set(light.pixels as object, { frame, shone });
    return shone.map(([node, [r, g, b]]) => [node, [r * light.color[0], g * light.color[1], b * light.color[2]]]);
  }

  private gathered(light: EnvironmentLight, assetFromWorld: Matrix4): DistantLight[] {
    const sums = new Float64Array(3 * NODES);
    for (const [direction, color] of environmentSamples({ ...light, color: [1, 1, 1] }, this.region, assetFromWorld)) {
      const node = this.nearest(direction);
      for (let c = 0; c < 3; ++c) sums[3 * node + c] += color[c];
    }
    return this.nodes.map((node, i): DistantLight => [node, [sums[3 * i], sums[3 * i + 1], sums[3 * i + 2]]]);
  }

  private nearest(direction: Triple): number {
    let [best, most] = [0, -Infinity];
    for (let i = 0; i < NODES; ++i) {
      const cosine = dot(this.nodes[i], direction);
      if (cosine > most) [best, most] = [i, cosine];
    }
    return best;
  }
}

function sum(kit: NodeKit, codes: number, width: number, uv: N, receiver: N): N {
  const { Break, If, int, ivec2, textureLoad, vec3 } = kit.tsl;
  const total = vec3(0).toVar();
  const units = unitsOf(kit, codes, width, uv);
  const response = decoder(kit, codes, width);
  const weights = kit.texture("srbfWeights");
  kit.each(MOST_DISTANT, "k", (k) => {
    const color = textureLoad(weights, ivec2(k, int(1))).rgb.toVar();
    If(color.abs().length().equal(0), () => Break());
    total.addAssign(color.mul(response(textureLoad(weights, ivec2(k, int(0))).xyz, ...units)));
  });
  kit.addPointLights(total, receiver, (direction) => response(direction, ...units));
  return total;
}

/** vec4 `u` of a row of the network. */
type Row = (row: number, u: number) => N;

function rowsOf(kit: NodeKit, width: number): Row {
  const network = kit.vectors("srbfNetwork");
  return (row, u) => network.element(kit.tsl.int(row * width + u));
}

const channels = (vector: N): N[] => [vector.x, vector.y, vector.z, vector.w];

/** `srbfNeuralCodes`. */
function unitsOf(kit: NodeKit, codes: number, width: number, uv: N): N[] {
  const row = rowsOf(kit, width);
  const units = Array.from({ length: width }, (_, u) => row(codes + 3, u).toVar());
  for (let i = 0; i < kit.layers; ++i) {
    const code = kit.decoded(uv, kit.tsl.int(i)).toVar();
    units.forEach((unit, u) => channels(code).forEach((x, c) => unit.addAssign(row(4 * i + c, u).mul(x)))); // unused channels are 0
  }
  return units;
}

/** `srbfNeuralToward`: of a direction and the units of a code, as a function of the shader's own. */
function decoder(kit: NodeKit, codes: number, width: number): (direction: N, ...units: N[]) => N {
  const { dot, exp, Fn, max, min, vec3 } = kit.tsl;
  const row = rowsOf(kit, width);
  const elu = (x: N) => max(x, 0).add(exp(min(x, 0)).sub(1)).toVar();
  const [hidden, hiddenBias] = [codes + 4, codes + 4 + 4 * width];
  const toward = ([direction, ...units]: N[]) => {
    const second = units.map((_, u) => row(hiddenBias, u).toVar());
    units.forEach((unit, v) => {
      const turned = [direction.x, direction.y, direction.z].map((x, c) => row(codes + c, v).mul(x));
      const first = elu(turned.reduce((total, x) => total.add(x), unit));
      second.forEach((own, u) => channels(first).forEach((x, c) => own.addAssign(row(hidden + 4 * v + c, u).mul(x))));
    });
    const bent = second.map(elu);
    const colors = [1, 2, 3].map((c) => bent.map((x, u) => dot(x, row(hiddenBias + c, u))).reduce((total, x) => total.add(x)));
    return row(hiddenBias + 4, 0).xyz.add(vec3(...colors));
  };
  const inputs = [{ name: "direction", type: "vec3" }, ...Array.from({ length: width }, (_, u) => ({ name: `unit${u}`, type: "vec4" }))];
  return Fn(toward).setLayout({ name: "srbfNeuralToward", type: "vec3", inputs });
}
