// The page that the browser tests open: the package's source with its engines, bundled.
import { fileURLToPath } from "node:url";
import { defineConfig } from "vite";
import { glsl } from "./build/glsl_plugin.ts";

export default defineConfig({
  root: fileURLToPath(new URL("test/pages", import.meta.url)),
  base: "./",
  plugins: [glsl()],
  build: { target: "es2022", minify: false, emptyOutDir: true, chunkSizeWarningLimit: 1e5, reportCompressedSize: false },
});
