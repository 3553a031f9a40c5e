/** The page's lights as a Python script that makes them in Blender. Units as in `blender_bake/light.py`. */
import type { Triple } from "../src";
import { unit } from "../src/lights";
import { cross } from "../src/matrix";
import { aim, levelSides, type LightState, linearColor, shiningOf, sides } from "./light_state";

const TYPES = { directional: "SUN", point: "POINT", sphere: "POINT", spot: "SPOT", area: "AREA" } as const;

/** The text of the script; environments and the scene's own lights, which Blender has already, are left out. */
export function blenderRig(lights: readonly LightState[]): string {
  const shining = new Set(shiningOf(lights));
  const told = lights.flatMap((light, i) => {
    if (light.kind === "environment" || light.kind === "named") return [];
    return [{ name: `srbf ${light.kind} ${i + 1}`, type: TYPES[light.kind], ...colored(linearColor(light), wattsOf(light)), hidden: !shining.has(light), ...placed(light) }];
  });
  return `"""Lights of srbf view. In Blender: Scripting, Open, Run; or blender SCENE.blend --python lights.py. Run again, it replaces its lights."""

import json

import bpy
from mathutils import Matrix

LIGHTS = json.loads(r"""
${JSON.stringify(told, undefined, 1)}
""")
COLLECTION = "srbf lights"

collection = bpy.data.collections.get(COLLECTION)
if collection is None:
    collection = bpy.data.collections.new(COLLECTION)
    bpy.context.scene.collection.children.link(collection)
for old in list(collection.objects):
    bpy.data.objects.remove(old)
for told in LIGHTS:
    data = bpy.data.lights.new(told["name"], told["type"])
    data.energy, data.color = told["energy"], told["color"]
    for name, value in told["settings"].items():
        setattr(data, name, value)
    light = bpy.data.objects.new(told["name"], data)
    light.matrix_world = Matrix(told["matrix"])
    light.hide_render = light.hide_viewport = told["hidden"]
    collection.objects.link(light)
`;
}

/** Watts, or irradiance of a sun, of a light whose irradiance at a0 is 1. */
function wattsOf(light: LightState): number {
  if (light.kind === "area") return Math.PI * light.a0 ** 2;
  return "a0" in light ? 4 * Math.PI * light.a0 ** 2 : 1;
}

function colored(color: Triple, watts: number): { energy: number; color: Triple } {
  const most = Math.max(...color, 1e-30);
  return { energy: watts * Math.max(...color), color: color.map((x) => x / most) as unknown as Triple };
}

type Made = Exclude<LightState, { kind: "environment" | "named" }>;

/** Where it is, and what only its type has. */
function placed(light: Made): { matrix: number[][]; settings: Record<string, unknown> } {
  if (light.kind === "directional") {
    const back = unit(light.direction);
    const [across, up] = levelSides(back);
    return { matrix: matrix(across, up, back, [0, 0, 0]), settings: { angle: 0 } };
  }
  if (light.kind === "point" || light.kind === "sphere") {
    return { matrix: matrix([1, 0, 0], [0, 1, 0], [0, 0, 1], light.position), settings: { shadow_soft_size: light.kind === "sphere" ? light.size : 0 } };
  }
  const back = unit(aim(light)).map((x) => -x) as unknown as Triple; // Blender's lights shine along -z
  if (light.kind === "spot") {
    const [inner, outer] = [light.inner, light.outer].map((degrees) => Math.cos((degrees * Math.PI) / 180));
    const [across, up] = levelSides(back);
    const settings = { shadow_soft_size: 0, spot_size: (light.outer * Math.PI) / 90, spot_blend: Math.min(1, (inner - outer) / Math.max(1 - outer, 1e-9)) };
    return { matrix: matrix(across, up, back, light.position), settings };
  }
  const across = unit(sides(light)[0]);
  return { matrix: matrix(across, cross(back, across), back, light.position), settings: { shape: "RECTANGLE", size: light.width, size_y: light.height } };
}

function matrix(x: Triple, y: Triple, z: Triple, at: Triple): number[][] {
  return [...[0, 1, 2].map((k) => [x[k], y[k], z[k], at[k]]), [0, 0, 0, 1]];
}
