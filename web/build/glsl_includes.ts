/** `#include "folder/file.glsl"`, once each, as `srbf.gl.includes` resolves them: the shader pack is read where it lies, and kept nowhere else. */
import { existsSync, readFileSync } from "node:fs";
import { dirname, join, relative, resolve } from "node:path";

const INCLUDE = /^\s*#\s*include\s+"([^"]+)"\s*$/;
const VERSION = /^\s*#\s*version\b.*$/;

export interface ResolvedShader {
  text: string;
  /** Absolute paths of all files that `text` was made of. */
  files: string[];
}

/**
 * A shader with its includes in place, sought under `root` and then beside the including file; `#version` is left out, since every engine
 * writes its own. Comments are dropped: they are for readers of the pack, and some engines split them at semicolons.
 *
 * @throws Error on a missing file or a cycle, named as a.glsl -> b.glsl -> a.glsl.
 */
export function resolveIncludes(path: string, root: string): ResolvedShader {
  const seen = new Set<string>();
  const text = expand(resolve(path), root, seen, []);
  return { text: withoutComments(text), files: [...seen] };
}

function withoutComments(text: string): string {
  const lines = text.replace(/\/\*[\s\S]*?\*\//g, "").split("\n");
  return lines.map((line) => line.replace(/\s*\/\/.*$/, "")).filter((line) => line.trim() !== "").join("\n");
}

function expand(path: string, root: string, seen: Set<string>, chain: string[]): string {
  const name = relative(root, path);
  if (chain.includes(name)) {
    throw new Error(`expected includes without a cycle, found ${[...chain.slice(chain.indexOf(name)), name].join(" -> ")}; break it`);
  }
  if (seen.has(path)) return "";
  seen.add(path);
  const lines = readFileSync(path, "utf8").split("\n").filter((line) => !VERSION.test(line));
  return lines
    .map((line, i) => {
      const target = INCLUDE.exec(line)?.[1];
      if (target === undefined) return line;
      const found = [join(root, target), join(dirname(path), target)].find((candidate) => existsSync(candidate));
      if (found === undefined) throw new Error(`${name}:${i + 1}: cannot find "${target}", neither under ${root} nor beside the including file`);
      return expand(resolve(found), root, seen, [...chain, name]);
    })
    .join("\n");
}
