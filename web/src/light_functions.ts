/** Smooth RGB functions of light direction, combinations of dense spherical Gaussians: `srbf/basis/light_functions.py`. */
import type { LightsInAssetFrame } from "./asset_frame";
import { GaussianSums } from "./environment_sums";
import type { Triple } from "./matrix";

const FAINT = 1e-9; // of the largest number
const MANY = 8; // of so many, from which on all are added

/** F functions over B shared unit centers, each with its own spread (rad); `coefficients` is (F, B, 3), row by row. */
export class LightFunctions {
  private readonly sums: GaussianSums[];
  private readonly which: readonly number[]; // of `sums`, for each function

  constructor(
    private readonly centers: readonly Triple[],
    spreads: readonly number[],
    private readonly coefficients: Float32Array,
    region: "sphere" | "hemisphere",
  ) {
    const distinct = [...new Set(spreads)];
    this.sums = distinct.map((spread) => new GaussianSums(centers, spread, region));
    this.which = spreads.map((spread) => distinct.indexOf(spread));
  }

  /** Sum over distant lights and environments of color times w_f(direction), (F, 3). */
  projected({ distant, environments, assetFromWorld }: Pick<LightsInAssetFrame, "distant" | "environments" | "assetFromWorld">): Float64Array {
    const numbers = 3 * this.centers.length;
    const summed = this.sums.map((sums) => {
      const own = new Float64Array(numbers);
      sums.addDistant(distant, own);
      for (const light of environments) sums.addEnvironment(light, assetFromWorld, own);
      return { own, places: lit(own) };
    });
    const projected = new Float64Array(3 * this.which.length);
    this.which.forEach((spread, f) => {
      const { own, places } = summed[spread];
      const coefficients = this.coefficients.subarray(f * numbers, (f + 1) * numbers);
      if (3 * MANY * places.length < numbers) addFew(coefficients, own, places, projected, 3 * f);
      else addAll(coefficients, own, projected, 3 * f);
    });
    return projected;
  }
}

/** Add the products of RGB numbers to those at `at`; a loop without indices takes a fifth of the time of `addFew`. */
function addAll(left: Float32Array, right: Float64Array, to: Float64Array, at: number): void {
  let [r, g, b] = [0, 0, 0];
  for (let i = 0; i < left.length; i += 3) {
    r += left[i] * right[i];
    g += left[i + 1] * right[i + 1];
    b += left[i + 2] * right[i + 2];
  }
  to[at] += r;
  to[at + 1] += g;
  to[at + 2] += b;
}

/** The same at some `places`. */
function addFew(left: Float32Array, right: Float64Array, places: Int32Array, to: Float64Array, at: number): void {
  for (let k = 0; k < places.length; ++k) {
    for (let c = 0; c < 3; ++c) to[at + c] += left[places[k] + c] * right[places[k] + c];
  }
}

/** Where the RGB numbers are that count in a sum: a sun reaches a few of thousands of narrow Gaussians. */
function lit(numbers: Float64Array): Int32Array {
  const least = FAINT * numbers.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
  const counts = (i: number) => Math.abs(numbers[i]) > least || Math.abs(numbers[i + 1]) > least || Math.abs(numbers[i + 2]) > least;
  return Int32Array.from({ length: numbers.length / 3 }, (_, i) => 3 * i).filter(counts);
}
