// The page of `srbf view` and of `srbf export --target web`: files that need no network.
import { fileURLToPath } from "node:url";
import { defineConfig } from "vite";
import { glsl } from "./build/glsl_plugin.ts";
import { licenses } from "./viewer/licenses_plugin.ts";

export default defineConfig({
  root: fileURLToPath(new URL("viewer", import.meta.url)),
  base: "./",
  plugins: [glsl(), licenses()],
  build: {
    target: "es2022",
    outDir: fileURLToPath(new URL("../srbf/viewer/page", import.meta.url)),
    emptyOutDir: true,
    chunkSizeWarningLimit: 1e5,
    reportCompressedSize: false,
    rollupOptions: { output: { entryFileNames: "viewer.js", assetFileNames: "viewer[extname]" } },
  },
});
