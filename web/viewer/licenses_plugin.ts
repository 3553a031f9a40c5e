/** `LICENSES.txt`: the terms of every package whose code is in the bundle, each in its authors' words. */
import { existsSync, readdirSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import type { Plugin } from "vite";

export function licenses(): Plugin {
  return {
    name: "licenses",
    generateBundle(_, bundle) {
      const folders = new Set<string>();
      const notices = new Set<string>();
      for (const chunk of Object.values(bundle)) {
        if (chunk.type !== "chunk") continue;
        for (const id of Object.keys(chunk.modules).filter((name) => name.includes("/node_modules/"))) {
          folders.add(packageOf(id));
          const notice = /^\s*\/\*[^]*?\*\//.exec(readFileSync(id.replace(/^\0/, "").split("?")[0], "utf8"))?.[0];
          if (notice?.includes("@license")) notices.add(notice.trim()); // of what a package holds of others
        }
      }
      const texts = [...[...folders].sort().map(terms), ...notices];
      this.emitFile({ type: "asset", fileName: "LICENSES.txt", source: `viewer.js holds code of these packages.\n\n${texts.join("\n\n")}\n` });
    },
  };
}

function packageOf(id: string): string {
  let folder = dirname(id.replace(/^\0/, ""));
  while (!existsSync(join(folder, "package.json")) || !JSON.parse(readFileSync(join(folder, "package.json"), "utf8")).version) folder = dirname(folder);
  return folder;
}

function terms(folder: string): string {
  const { name, version, license } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
  const file = readdirSync(folder).find((entry) => /^licen[cs]e/i.test(entry));
  if (!file) throw new Error(`expected the terms of ${name} in ${folder}, found no LICENSE; do not ship it`);
  return `${name} ${version} (${license})\n\n${readFileSync(join(folder, file), "utf8").trim()}`;
}
