/** `#include "folder/file.glsl"`, once each, as `srbf/gl/includes.py` resolves them; a test compares the two on every stage of the shader pack. */
import { existsSync, readFileSync } from "node:fs";
import { dirname, join, relative, resolve } from "node:path";

const INCLUDE = /^\s*#\s*include\b\s*(?:"([^"]+)")?/;
const VERSION = /^\s*#\s*version\b/;

export interface ResolvedShader {
  text: string;
  /** Absolute paths of all files that `text` was made from. */
  files: string[];
}

/**
 * A shader with its includes in place, looked for under `root` and then beside the including file; `#version` is left out, since every engine
 * writes its own. Comments are dropped: they are for readers of the pack, and some engines split them at semicolons.
 *
 * @throws Error on a missing file, a malformed include, or a cycle, named as a.glsl -> b.glsl -> a.glsl.
 */
export function resolveIncludes(path: string, root: string): ResolvedShader {
  const seen = new Set<string>();
  const text = expand(resolve(path), resolve(root), seen, []);
  return { text, files: [...seen] };
}

function expand(path: string, root: string, seen: Set<string>, chain: string[]): string {
  const name = relative(root, path);
  if (chain.includes(name)) {
    throw new Error(`expected includes without a cycle, found ${[...chain.slice(chain.indexOf(name)), name].join(" -> ")}; break it`);
  }
  if (seen.has(path)) return "";
  seen.add(path);
  const lines = withoutComments(readFileSync(path, "utf8")).split("\n");
  return lines
    .map((line, i) => {
      if (VERSION.test(line)) return "";
      const include = INCLUDE.exec(line);
      if (!include) return line.trimEnd();
      const target = include[1];
      if (target === undefined) throw new Error(`${name}:${i + 1}: expected #include "folder/file.glsl", found no quoted path`);
      const found = [join(root, target), join(dirname(path), target)].find((candidate) => existsSync(candidate));
      if (found === undefined) throw new Error(`${name}:${i + 1}: cannot find "${target}", neither under ${root} nor beside the including file`);
      return expand(resolve(found), root, seen, [...chain, name]);
    })
    .filter((line) => line.trim() !== "")
    .join("\n");
}

/** Line breaks are kept, so that lines have the numbers of the file. */
function withoutComments(text: string): string {
  return text.replace(/\/\*[\s\S]*?\*\/|\/\/[^\n]*/g, (comment) => comment.replace(/[^\n]/g, ""));
}
