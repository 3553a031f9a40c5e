/** Surfaces that change after the bake: other albedo, and emission, of a transfer asset's objects: `srbf/methods/surface_changes.py`. */
import { SrbfError } from "./errors";
import type { AssetFiles } from "./files";
import { type LightValues, readTable, rgb, summed } from "./light_values";
import type { NamedLight } from "./lights";
import type { Manifest } from "./manifest";
import type { Triple } from "./matrix";

const FILES = ["surface_sent", "surface_feedback", "surface_objects"] as const;
const MOST_REFLECTED = 0.99; // share of light that a bounce keeps at most
const SERIES = 24; // reflections from which on all are summed
export const MOST_TERMS = 512; // of a series without end, as exports have it
const SMALL = 1e-7; // of the sum: a reflection that no longer counts
const TOLD = 12; // names in an error

/** Keys of asset.json of an asset that was fitted with `--editable`. */
export interface SurfacesManifest extends Manifest, Partial<Record<(typeof FILES)[number] | "surface_emission", { file: string }>> {
  surfaces?: { objects: string[]; scales: Record<string, number>; bounces?: number };
}

/** How surfels reflect: their albedo, (S, 3), and the unit of each one's column of `surfel_gather`, (S,). */
export interface SurfelReflection {
  albedo: Float64Array;
  units: Float64Array;
}

/** What the asset knows of O objects, r shapes and S surfels. */
interface Known extends SurfelReflection {
  rank: number;
  count: number;
  /** From radiosity of surfels to weights, and what the shapes lay on the surfels, (r, S). */
  gather: Float32Array;
  sent: Float32Array;
  /** gather rho sent, (r, r, 3). */
  feedback: LightValues;
  /** What part of a surfel's area each object has, (O, S). */
  shares: Float32Array;
  /** Weights of objects that emit a mean radiance of 1 in their own pattern, without bounces, (r, O, 3); undefined: evenly, by `shares`. */
  emission?: LightValues;
}

export class Surfaces {
  /** Names of the objects that can change: those with surfels. */
  readonly names: readonly string[];
  /** How often a surface is exchanged between the surfels at most; undefined: always. */
  readonly bounces: number | undefined;
  /** Counts the changes of albedo. */
  version = 0;
  /** Albedo less that of the bake, (S, 3); undefined where they are the same. */
  change?: Float64Array;
  private readonly painted = new Map<string, Triple>();
  private readonly emitted = new Map<string, Float64Array>(); // of white light

  private constructor(
    private readonly manifest: SurfacesManifest,
    readonly known: Known,
  ) {
    const { shares, count } = known;
    const seen = (i: number) => shares.subarray(i * count, (i + 1) * count).some((share) => share > 0);
    this.names = (manifest.surfaces?.objects ?? []).filter((_, i) => seen(i));
    const bounces = manifest.surfaces?.bounces;
    this.bounces = bounces === undefined || bounces >= SERIES ? undefined : bounces;
  }

  /**
   * Undefined where the asset was not fitted with `--editable`. `gather`: with columns in `units`; undefined of assets that have another table.
   *
   * @throws SrbfError on tables of other sizes, and on an asset that was fitted before there was `surfel_gather`.
   */
  static async read(files: AssetFiles, manifest: SurfacesManifest, gather: LightValues | undefined, reflection: SurfelReflection | undefined): Promise<Surfaces | undefined> {
    const told = manifest.surfaces;
    if (!told) return undefined;
    if (!gather || !reflection) throw new SrbfError("expected surfel_gather in asset.json of an asset whose surfaces can change, found none; fit the asset again");
    const { functions: rank, count } = gather;
    const rows = [rank, rank, told.objects.length];
    const columns = [count, rank, count];
    const [sent, feedback, shares] = await Promise.all(
      FILES.map((name, i) => {
        const file = manifest[name]?.file;
        if (file === undefined) throw new SrbfError(`expected ${name} in asset.json, found none; fit the asset again`);
        return readTable(files, { file, scale: told.scales[name] }, rows[i], columns[i]);
      }),
    );
    const own = manifest.surface_emission && { file: manifest.surface_emission.file, scale: told.scales.surface_emission };
    const emission = own && (await readTable(files, own, rank, told.objects.length));
    const whole = gather.data.map((x, i) => x * reflection.units[i % count]);
    return new Surfaces(manifest, { ...reflection, rank, count, gather: whole, sent: sent.data, feedback, shares: shares.data, emission });
  }

  /** Weights of the shapes, (r, 3), from irradiance on the surfels, (S, 3), with the albedo that they have now. */
  received(irradiance: Float64Array): Float64Array {
    const { gather, albedo } = this.known;
    const { change } = this;
    return this.series(product(gather, irradiance.map((e, i) => (albedo[i] + (change?.[i] ?? 0)) * e)), this.bounces, change);
  }

  /** What the columns of `surfel_gather` take irradiance by, (S, 3), with the albedo that surfels have now. */
  get reflectance(): Float64Array {
    return reflectanceOf(this.known, this.change);
  }

  /** Weights of the shapes, (r, 3), under objects that emit diffusely: `color` of a named light is the radiance. @throws SrbfError on an unknown object. */
  emission(lights: readonly NamedLight[]): Float64Array {
    const out = new Float64Array(3 * this.known.rank);
    for (const { name, color } of lights) this.white(name).forEach((weight, i) => (out[i] += weight * color[i % 3]));
    return out;
  }

  /**
   * Repaint an object in linear Rec.709, or give it its own albedo back: bounces off it change everywhere.
   *
   * @throws SrbfError on an unknown object, and on an asset of radiance, which has the albedo in it.
   */
  setAlbedo(name: string, color?: Triple): void {
    this.share(name);
    if (this.manifest.quantity !== "irradiance") throw new SrbfError("expected an asset of irradiance to change the albedo of, found radiance, which has the albedo in it; bake irradiance");
    if (color && !(color.length === 3 && color.every((x) => x >= 0 && x <= 1))) throw new SrbfError(`expected an albedo of three numbers from 0 to 1, found ${color.join(", ")}`);
    if (String(color) === String(this.painted.get(name))) return;
    if (color) this.painted.set(name, color);
    else this.painted.delete(name);
    const { albedo, count } = this.known;
    const now = albedo.slice();
    for (const [object, paint] of this.painted) {
      const share = this.share(object);
      for (let i = 0; i < 3 * count; ++i) now[i] += share[Math.floor(i / 3)] * (Math.min(paint[i % 3], MOST_REFLECTED) - albedo[i]);
    }
    this.change = this.painted.size ? now.map((x, i) => Math.min(MOST_REFLECTED, Math.max(0, x)) - albedo[i]) : undefined;
    this.emitted.clear();
    ++this.version;
  }

  /** @throws SrbfError on an object that the asset does not have. */
  check(name: string): void {
    this.share(name);
  }

  /** Of an object that emits a mean radiance of 1: of what it lays on the receivers itself, and of all bounces. */
  private white(name: string): Float64Array {
    const known = this.emitted.get(name);
    if (known) return known;
    const share = this.share(name);
    const { emission, gather, count } = this.known;
    const at = this.manifest.surfaces?.objects.indexOf(name) ?? -1;
    const first = emission ? column(emission, at) : product(gather, rgb(Float64Array.from(share, (x) => Math.PI * x), count));
    const out = this.series(first, this.bounces === undefined ? undefined : this.bounces + 1, this.change);
    this.emitted.set(name, out);
    return out;
  }

  /**
   * sum over k < `terms` of F^k first, F = feedback + gather `change` sent; undefined: until terms no longer count, MOST_TERMS at most. Term by term, since
   * that takes products of a matrix and a vector alone.
   */
  private series(first: Float64Array, terms: number | undefined, change?: Float64Array): Float64Array {
    const { gather, sent, feedback } = this.known;
    const total = terms === 0 ? new Float64Array(first.length) : first.slice();
    let last = first;
    for (let k = 1; k < (terms ?? MOST_TERMS) && largest(last) > SMALL * largest(total); ++k) {
      const next = summed(feedback, last);
      if (change) product(gather, productTransposed(sent, last).map((x, i) => x * change[i])).forEach((x, i) => (next[i] += x));
      next.forEach((x, i) => (total[i] += x));
      last = next;
    }
    return total;
  }

  private share(name: string): Float32Array {
    const { names } = this;
    const at = this.manifest.surfaces?.objects.indexOf(name) ?? -1;
    if (!names.includes(name)) throw new SrbfError(`expected an object of ${names.slice(0, TOLD).join(", ")}${names.length > TOLD ? ", …" : ""}, found ${JSON.stringify(name)}`);
    const { count } = this.known;
    return this.known.shares.subarray(at * count, (at + 1) * count);
  }
}

/** What the columns of `surfel_gather` take irradiance by, (S, 3): the albedo, with a `change` or not, times the units. */
export function reflectanceOf({ albedo, units }: SurfelReflection, change?: Float64Array): Float64Array {
  return albedo.map((x, i) => (x + (change?.[i] ?? 0)) * units[Math.floor(i / 3)]);
}

/** @throws SrbfError on an asset whose surfaces cannot change. */
export function changeable(surfaces: Surfaces | undefined): Surfaces {
  if (!surfaces) throw new SrbfError("expected an asset whose surfaces can change for an object that emits or is repainted, found one without; fit with --editable");
  return surfaces;
}

/** matrix (n, m) times RGB numbers (m, 3). */
function product(matrix: Float32Array, numbers: Float64Array): Float64Array {
  const columns = numbers.length / 3;
  const out = new Float64Array((3 * matrix.length) / columns);
  for (let i = 0, at = 0; i < out.length; i += 3) {
    let [r, g, b] = [0, 0, 0];
    for (let j = 0; j < numbers.length; j += 3, ++at) {
      r += matrix[at] * numbers[j];
      g += matrix[at] * numbers[j + 1];
      b += matrix[at] * numbers[j + 2];
    }
    out[i] = r;
    out[i + 1] = g;
    out[i + 2] = b;
  }
  return out;
}

/** Column `at` of a table, (r, 3). */
function column(table: LightValues, at: number): Float64Array {
  return Float64Array.from({ length: 3 * table.functions }, (_, i) => table.data[3 * (Math.floor(i / 3) * table.count + at) + (i % 3)]);
}

/** The transposed of matrix (n, m) times RGB numbers (n, 3). */
function productTransposed(matrix: Float32Array, numbers: Float64Array): Float64Array {
  const columns = (3 * matrix.length) / numbers.length;
  const out = new Float64Array(3 * columns);
  for (let i = 0, at = 0; i < numbers.length; i += 3) {
    const [r, g, b] = [numbers[i], numbers[i + 1], numbers[i + 2]];
    for (let j = 0; j < out.length; j += 3, ++at) {
      out[j] += matrix[at] * r;
      out[j + 1] += matrix[at] * g;
      out[j + 2] += matrix[at] * b;
    }
  }
  return out;
}

const largest = (numbers: Float64Array) => numbers.reduce((most, x) => Math.max(most, Math.abs(x)), 0);
