// `SRBF_ASSETS=FOLDER npm run example`: the example, with the folder's assets and meshes at the server's root.
import { fileURLToPath } from "node:url";
import { defineConfig } from "vite";
import { glsl } from "./build/glsl_plugin.ts";

const here = (path: string) => fileURLToPath(new URL(path, import.meta.url));

export default defineConfig({
  root: here("examples"),
  publicDir: process.env.SRBF_ASSETS ?? false,
  plugins: [glsl()],
  resolve: {
    alias: [
      { find: /^srbf\/(three|babylon|playcanvas)$/, replacement: here("src/$1/index.ts") },
      { find: /^srbf$/, replacement: here("src/index.ts") },
    ],
  },
  server: { fs: { allow: [here(".."), here(".")] } },
  build: { target: "es2022" },
});
