/** Light linking: which objects of its scene a light shines on, and which shadow it: `srbf/light_linking.py`. */
import { SrbfError } from "./errors";

const SHOWN = 8; // names in a line

/** A choice of a scene's objects by name: all but those of `without`, or of `only` those. */
export interface Objects {
  readonly only?: readonly string[];
  readonly without?: readonly string[];
}

/** What a light of a deep framebuffer chooses: all objects unless given. */
export interface Links {
  /** What it shines on. */
  readonly receivers?: Objects;
  /** What casts its shadows. */
  readonly blockers?: Objects;
}

/** Names of objects, and the number among them of each surfel or triangle. */
export interface Numbered {
  readonly names: readonly string[];
  readonly objects: Int32Array;
}

/** Whether lights of a kind may choose: environments and a scene's own lights by name may not. */
export const isLinkable = (kind: unknown): boolean => kind !== "environment" && kind !== "named";

export const isLinked = ({ receivers, blockers }: Links): boolean => Boolean(receivers ?? blockers);

/** The choices alone of what may have more. */
export const linksOf = ({ receivers, blockers }: Links): Links => ({ ...(receivers ? { receivers } : {}), ...(blockers ? { blockers } : {}) });

/** The choice of those objects alone that have one of the names. */
export const within = ({ only, without }: Objects, names: ReadonlySet<string>): Objects => ({
  ...(only ? { only: only.filter((name) => names.has(name)) } : {}),
  ...(without ? { without: without.filter((name) => names.has(name)) } : {}),
});

export const isChosen = ({ only, without }: Objects, name: string): boolean => (!only || only.includes(name)) && !without?.includes(name);

/** The objects of a pool's surfels and of its scene's triangles. */
export class LinkedObjects {
  /** All names by which lights choose, sorted. */
  readonly names: readonly string[];
  private readonly known = new Map<string, Uint8Array>();

  constructor(
    private readonly surfels: Numbered,
    private readonly triangles: Numbered,
  ) {
    this.names = [...new Set([...surfels.names, ...triangles.names])].sort();
  }

  /** Of each surfel 1 where a light shines on it, else 0; undefined: on all. The same array for the same choice. @throws SrbfError on a name that the scene lacks. */
  lit({ receivers }: Links): Uint8Array | undefined {
    return receivers && this.chosen("receivers", receivers, this.surfels);
  }

  /** Of each triangle 1 where it casts a shadow of a light; undefined: all do. As `lit`. */
  casting({ blockers }: Links): Uint8Array | undefined {
    return blockers && this.chosen("blockers", blockers, this.triangles);
  }

  /** @throws SrbfError on a name that the scene lacks. */
  require({ receivers, blockers }: Links): void {
    if (receivers) this.check("receivers", receivers);
    if (blockers) this.check("blockers", blockers);
  }

  private chosen(link: keyof Links, choice: Objects, { names, objects }: Numbered): Uint8Array {
    const key = JSON.stringify([link, choice]);
    let found = this.known.get(key);
    if (!found) {
      this.check(link, choice);
      const own = names.map((name) => isChosen(choice, name));
      found = Uint8Array.from(objects, (object) => Number(own[object]));
      this.known.set(key, found);
    }
    return found;
  }

  private check(link: keyof Links, { only = [], without = [] }: Objects): void {
    const missing = [...only, ...without].find((name) => !this.names.includes(name));
    if (missing === undefined) return;
    const listed = this.names.slice(0, SHOWN).map((name) => JSON.stringify(name)).join(", ");
    throw new SrbfError(`expected objects of the scene among a light's ${link}, found ${JSON.stringify(missing)}; it has ${listed || "none"}${this.names.length > SHOWN ? ", …" : ""}`);
  }
}
