import { mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { expect, it } from "vitest";
import { resolveIncludes } from "../build/glsl_includes.ts";

function folder(files: Record<string, string>): string {
  const root = mkdtempSync(join(tmpdir(), "srbf-glsl-"));
  for (const [name, text] of Object.entries(files)) writeFileSync(join(root, name), text);
  return root;
}

it("puts every file once, where it is first asked for, without versions and comments", () => {
  const root = folder({
    "a.glsl": '#version 330 core\n#include "b.glsl"\n#include "c.glsl"\nfloat a;  // one; two',
    "b.glsl": '/* head */\n#include "c.glsl"\nfloat b;',
    "c.glsl": "float c;",
  });
  const { text, files } = resolveIncludes(join(root, "a.glsl"), root);
  expect(text.split("\n")).toEqual(["float c;", "float b;", "float a;"]);
  expect(files).toHaveLength(3);
});

it("follows no include in a comment", () => {
  const root = folder({ "a.glsl": '/*\n#include "none.glsl"\n*/\n// #include "none.glsl"\nfloat a;' });
  expect(resolveIncludes(join(root, "a.glsl"), root).text).toBe("float a;");
});

it("names cycles and missing files", () => {
  const root = folder({ "a.glsl": '#include "b.glsl"', "b.glsl": '#include "a.glsl"', "d.glsl": '\n#include "none.glsl"' });
  expect(() => resolveIncludes(join(root, "a.glsl"), root)).toThrow("a.glsl -> b.glsl -> a.glsl");
  expect(() => resolveIncludes(join(root, "d.glsl"), root)).toThrow('d.glsl:2: cannot find "none.glsl"');
});
