/** The scene's own lights by their names: which an asset has, and how they are dimmed, recolored and switched. */
import type { Asset } from "./asset";
import { SrbfError } from "./errors";
import { type Light, type NamedLight, namedLight } from "./lights";
import type { Manifest } from "./manifest";
import type { Triple } from "./matrix";
import type { Fail } from "./methods/method";

const TOLD = 12; // names in an error

/** Keys of asset.json of light domain `named`: its lights, in the order of the columns or maps that hold them. */
export interface NamedManifest extends Manifest {
  lights?: { name: string; objects?: string[] }[];
}

export function checkNames({ lights }: NamedManifest, fail: Fail): void {
  if (!Array.isArray(lights) || lights.length === 0 || lights.some((light) => typeof light?.name !== "string")) fail("lights with names", lights);
  const names = (lights as { name: string }[]).map(({ name }) => name);
  const twice = names.find((name, i) => names.indexOf(name) !== i);
  if (twice !== undefined) fail("one light for each name", twice);
}

export const namesOf = ({ lights }: NamedManifest): string[] => (lights as { name: string }[]).map(({ name }) => name);

/** Color of each of `names`, (N, 3), that of equal ones summed. @throws SrbfError on a light of another name. */
export function colorsOf(names: readonly string[], lights: Iterable<NamedLight>): Float64Array {
  const index = new Map(names.map((name, i) => [name, i]));
  const out = new Float64Array(3 * names.length);
  for (const { name, color } of lights) {
    const at = index.get(name);
    if (at === undefined) throw unknown(names, name);
    for (let c = 0; c < 3; ++c) out[3 * at + c] += color[c];
  }
  return out;
}

/** Every light of the asset as the scene has it set; none for an asset without named lights. */
export function asDesigned(asset: Pick<Asset, "tables">): NamedLight[] {
  return (asset.tables.names ?? []).map((name) => namedLight(name));
}

/**
 * Put the named light of `lights` at `intensity` (1: as designed, 0: off), in `color` (linear Rec.709).
 *
 * @throws SrbfError on a name that the asset does not have, or numbers that are not finite.
 */
export function setNamedLight(asset: Pick<Asset, "tables">, lights: Light[], name: string, intensity = 1, color: Triple = [1, 1, 1]): void {
  const names = asset.tables.names ?? [];
  if (!names.includes(name)) throw unknown(names, name);
  put(lights, namedLight(name, [intensity * color[0], intensity * color[1], intensity * color[2]]));
}

/** Add a named light to `lights`, in place of that of the same name. */
export function put(lights: Light[], light: NamedLight): void {
  const { name } = light;
  const at = lights.findIndex((other) => other.kind === "named" && other.name === name);
  if (at < 0) lights.push(light);
  else lights[at] = light;
}

function unknown(names: readonly string[], name: string): SrbfError {
  if (names.length === 0) return new SrbfError(`expected an asset of named lights for ${JSON.stringify(name)}, found one of other lights; srbf bake --light-set named`);
  const told = [...names.slice(0, TOLD).map((one) => JSON.stringify(one)), ...(names.length > TOLD ? [`… (${names.length} in all)`] : [])];
  return new SrbfError(`expected a light of ${told.join(", ")}, found ${JSON.stringify(name)}; was it renamed after the bake?`);
}
