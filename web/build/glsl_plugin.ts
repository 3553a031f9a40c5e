/** A Vite plugin: importing a .glsl, .vert or .frag file gives its text, includes of the shader pack in place. */
import { fileURLToPath } from "node:url";
import type { Plugin } from "vite";
import { resolveIncludes } from "./glsl_includes.ts";

export const SHADER_PACK = fileURLToPath(new URL("../../glsl", import.meta.url));

export function glsl(root: string = SHADER_PACK): Plugin {
  return {
    name: "srbf-glsl",
    enforce: "pre",
    load(id) {
      const path = id.split("?")[0];
      if (!/\.(glsl|vert|frag)$/.test(path)) return null;
      const shader = resolveIncludes(path, root);
      for (const file of shader.files) this.addWatchFile(file);
      return `export default ${JSON.stringify(shader.text)};`;
    },
  };
}
