import { defineConfig } from "vitest/config";
import { glsl } from "./build/glsl_plugin.ts";

export default defineConfig({
  plugins: [glsl()],
  build: {
    target: "es2022",
    minify: false,
    lib: {
      entry: {
        index: "src/index.ts",
        three: "src/three/index.ts",
        three_tsl: "src/three/tsl/index.ts",
        babylon: "src/babylon/index.ts",
        playcanvas: "src/playcanvas/index.ts",
      },
      formats: ["es"],
    },
    rollupOptions: { external: [/^three(\/|$)/, /^@babylonjs\//, /^playcanvas$/, "fast-png", "ktx-parse", "parse-exr"] },
  },
  test: { include: ["test/**/*.test.ts"] },
});
