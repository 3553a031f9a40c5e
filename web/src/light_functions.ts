/** Smooth RGB functions of light direction, combinations of dense spherical Gaussians: `srbf/basis/light_functions.py`. */
import type { LightsInAssetFrame } from "./asset_frame";
import { GaussianSums } from "./environment_sums";
import type { Triple } from "./matrix";

const FAINT = 1e-9; // of the largest number

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
      let [r, g, b] = [0, 0, 0];
      for (const i of places) {
        r += coefficients[i] * own[i];
        g += coefficients[i + 1] * own[i + 1];
        b += coefficients[i + 2] * own[i + 2];
      }
      projected.set([r, g, b], 3 * f);
    });
    return projected;
  }
}

/** Where the RGB numbers are that count in a sum: a sun reaches a few of thousands of narrow Gaussians. */
function lit(numbers: Float64Array): Int32Array {
  const least = FAINT * numbers.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
  const counts = (i: number) => Math.abs(numbers[i]) > least || Math.abs(numbers[i + 1]) > least || Math.abs(numbers[i + 2]) > least;
  return Int32Array.from({ length: numbers.length / 3 }, (_, i) => 3 * i).filter(counts);
}
