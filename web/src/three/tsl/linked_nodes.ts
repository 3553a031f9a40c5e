/** Sparse links between surfels, view clusters and lobes in three.js' node language. */
import type { DataTexture } from "three";
import * as tsl from "three/tsl";
import { ACROSS, type PackedLinks } from "../../gather";
import { tableTexture } from "../textures";
import { each } from "./inputs";
import { THREADS } from "./kernels";
import type { N } from "./nodes";
import { folded } from "./table_nodes";

const { float, ivec3, textureLoad, vec3 } = tsl as Record<string, N>;

export class LinkNodes {
  private readonly links: DataTexture;
  private readonly rows: DataTexture;
  private readonly rays: number;

  constructor({ links, rows, rays }: PackedLinks) {
    this.links = tableTexture(links);
    this.rows = tableTexture(rows);
    this.rays = rays;
  }

  /** `srbfLinkedLight` of the row at a texel of the rows' texture, or what one `thread` of a workgroup adds to it; `light`: a texture node, `width` texels across. */
  light(at: N, light: N, width: number, thread?: N): N {
    const columns = (this.links.image as { width: number }).width;
    const row = ivec3(textureLoad(this.rows, at).xyz.add(0.5)).toVar();
    const first = row.y.mul(columns).add(row.x).toVar();
    const total = vec3(0).toVar();
    const own = thread === undefined ? { count: row.z, number: (i: N) => i } : { count: row.z.add(THREADS - 1).sub(thread).div(THREADS).toVar(), number: (i: N) => i.mul(THREADS).add(thread) };
    each(own.count, "link", (i) => {
      const link = ivec3(textureLoad(this.links, folded(first.add(own.number(i)).toVar(), columns)).xyz.mul(255).add(0.5)).toVar();
      const surfel = link.x.add(link.y.mul(256)).toVar();
      total.addAssign(textureLoad(light, folded(surfel, width)).rgb.mul(float(link.z)));
    });
    return total.div(this.rays);
  }

  /** The row of a number. */
  static at(number: N): N {
    return folded(number, ACROSS);
  }

  dispose(): void {
    this.links.dispose();
    this.rows.dispose();
  }
}
