/** The page's lights as a Python script that makes them in Blender. Units as in `blender_bake/light.py`. */
import type { Links, Objects, Triple } from "../src";
import { linksOf } from "../src/light_linking";
import { profileAxes } from "../src/light_profile";
import { unit } from "../src/lights";
import { cross } from "../src/matrix";
import { type Designed, exactColor } from "./asset_lights";
import { aim, levelSides, type LightState, shiningOf, sides } from "./light_state";

const TYPES = { directional: "SUN", point: "POINT", sphere: "POINT", spot: "SPOT", area: "AREA" } as const;

/**
 * The text of the script; environments and named lights are left out. A light with a name sets the scene's light of that name where there is one; all others are made.
 * `sunAngle`: of suns without an angle of their own that are made, degrees. `designed`: the scene's own lights; those that the page no longer has are hidden.
 */
export function blenderRig(lights: readonly LightState[], sunAngle = 0, designed: Designed = []): string {
  const shining = new Set(shiningOf(lights));
  const told = lights.flatMap((light, i) => {
    if (light.kind === "environment" || light.kind === "named") return [];
    const name = light.name ?? `srbf ${light.kind} ${i + 1}`;
    return [{ name, own: light.name !== undefined, type: TYPES[light.kind], profile: ownProfile(light, designed), ...colored(exactColor(light, designed), wattsOf(light)), hidden: !shining.has(light), links: linksOf(light.links ?? {}), changed: !hasLinksOf(light, designed), ...placed(light) }];
  });
  const kept = new Set(lights.map(({ name }) => name));
  const removed = designed.flatMap(({ name }) => (kept.has(name) ? [] : [name]));
  return `"""Lights of srbf view. In Blender: Scripting, Open, Run; or blender SCENE.blend --python lights.py. Lights of the scene are set, the others made; run again, it replaces those that it made."""

import json

import bpy
from mathutils import Matrix

LIGHTS = json.loads(r"""
${JSON.stringify(told, undefined, 1)}
""")
REMOVED = json.loads(r"""${JSON.stringify(removed)}""")
COLLECTION = "srbf lights"
ROUND = 0.8862269254527579  # side of a square of the area of a disk of diameter 1

collection = bpy.data.collections.get(COLLECTION)
if collection is None:
    collection = bpy.data.collections.new(COLLECTION)
    bpy.context.scene.collection.children.link(collection)
for old in list(collection.objects):
    bpy.data.objects.remove(old)


def own(name, kind):
    """The scene's light of that name, its data shared with no other; None where there is none of that kind."""
    light = bpy.context.scene.objects.get(name)
    if light is None or light.type != "LIGHT" or light.data.type != kind or light.library or light.data.library:
        return None
    if light.data.users > 1:
        light.data = light.data.copy()
    return light


def set_own(light, told):
    """Set what the page shows of a light: a disk's shape and the nodes of an IES texture stay."""
    data, settings = light.data, dict(told["settings"])
    if told["profile"] is None:
        data.use_nodes = False
    else:
        told = {**told, "energy": told["energy"] / keep_texture(data)}
    for name, plain in (("exposure", 0), ("use_temperature", False), ("normalize", True)):
        if hasattr(data, name):
            setattr(data, name, plain)
    if data.type == "AREA" and data.shape in {"DISK", "ELLIPSE"}:
        data.shape = "ELLIPSE" if data.shape == "ELLIPSE" or abs(settings["size"] - settings["size_y"]) > 1e-5 else "DISK"
        settings = {"size": settings["size"] / ROUND, "size_y": settings["size_y"] / ROUND}
    fill(light, told, settings)


def keep_texture(data):
    """Leave white light that the IES texture of a light shapes; what the texture multiplies by."""
    data.use_nodes = True
    tree = data.node_tree
    texture = next((node for node in tree.nodes if node.type == "TEX_IES"), None)
    shader = next((node for node in tree.nodes if node.type == "EMISSION"), None)
    if texture is None or shader is None:
        data.use_nodes = False
        return 1
    for link in [one for one in tree.links if one.to_socket == shader.inputs["Color"]]:
        tree.links.remove(link)
    shader.inputs["Color"].default_value = (1, 1, 1, 1)
    tree.links.new(texture.outputs["Fac"], shader.inputs["Strength"])
    return texture.inputs["Strength"].default_value or 1


def fill(light, told, settings):
    light.data.energy, light.data.color = told["energy"], told["color"]
    for name, value in settings.items():
        setattr(light.data, name, value)
    place = Matrix(told["matrix"])
    if light.data.type == "SUN":  # it may stand anywhere
        place.translation = light.matrix_world.translation
    light.matrix_world = place
    light.hide_render = light.hide_viewport = told["hidden"]
    for kind, place in (("receivers", "receiver_collection"), ("blockers", "blocker_collection")):
        present, made, choice = getattr(light.light_linking, place), f"srbf {light.name} {kind}", told["links"].get(kind)
        if told["changed"] or (present is not None and present.name == made):  # else as designed
            setattr(light.light_linking, place, chosen(made, choice) if choice else None)


def chosen(name, choice):
    """The collection of what a light shines on, or of what shadows it."""
    old = bpy.data.collections.get(name)
    if old is not None:
        bpy.data.collections.remove(old)
    made = bpy.data.collections.new(name)
    states = dict.fromkeys(choice.get("only", ()), "INCLUDE") | dict.fromkeys(choice.get("without", ()), "EXCLUDE")
    objects = bpy.context.scene.objects
    for one in states:
        if one in objects:
            made.objects.link(objects[one])
    for member, one in zip(made.collection_objects, made.objects):
        member.light_linking.link_state = states[one.name]
    if "only" in choice and not any(states[one.name] == "INCLUDE" for one in made.objects):
        nothing = bpy.data.objects.get("srbf nothing") or bpy.data.objects.new("srbf nothing", None)
        made.objects.link(nothing)  # a collection without any chooses all
    return made


for name in REMOVED:
    light = bpy.context.scene.objects.get(name)
    if light is not None and light.type == "LIGHT":
        light.hide_render = light.hide_viewport = True
for told in LIGHTS:
    light = own(told["name"], told["type"]) if told["own"] else None
    if light is not None:
        set_own(light, told)
        continue
    data = bpy.data.lights.new(told["name"], told["type"])
    if data.type == "SUN":
        data.angle = ${(sunAngle * Math.PI) / 180}  # unless told otherwise
    elif data.type == "SPOT":
        data.shadow_soft_size = 0  # unless told otherwise
        data.use_soft_falloff = False  # else it is a disk that turns to each receiver
    light = bpy.data.objects.new(told["name"], data)
    fill(light, told, told["settings"])
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

/** Whether a light chooses the same objects as its design. */
function hasLinksOf({ name, links = {} }: LightState, designed: Designed): boolean {
  const own = linksOf((designed.find((one) => one.name === name)?.light ?? {}) as Links);
  const sorted = ({ only, without = [] }: Objects = {}) => JSON.stringify([only && [...only].sort(), [...without].sort()]);
  return sorted(own.receivers) === sorted(links.receivers) && sorted(own.blockers) === sorted(links.blockers);
}

/** The profile that a light of the scene has there and still has; null of others, since the script has no files. */
function ownProfile(light: LightState, designed: Designed): string | null {
  const own = designed.find(({ name }) => name === light.name)?.light.profile;
  return "profile" in light && light.profile !== undefined && light.profile === own ? light.profile : null;
}

type Made = Exclude<LightState, { kind: "environment" | "named" }>;

/** Where it is, and what only its type has. */
function placed(light: Made): { matrix: number[][]; settings: Record<string, unknown> } {
  if (light.kind === "directional") {
    const back = unit(light.direction);
    const [across, up] = levelSides(back);
    return { matrix: matrix(across, up, back, [0, 0, 0]), settings: light.angle === undefined ? {} : { angle: (light.angle * Math.PI) / 180 } };
  }
  if (light.kind === "point" || light.kind === "sphere") {
    const frame = light.profile === undefined ? undefined : profileFrame(unit(light.direction ?? [0, 0, -1]), light.roll);
    return { matrix: matrix(...(frame ?? [[1, 0, 0], [0, 1, 0], [0, 0, 1]]), light.position), settings: { shadow_soft_size: light.kind === "sphere" ? light.size : 0 } };
  }
  const back = unit(aim(light)).map((x) => -x) as unknown as Triple; // Blender's lights shine along -z
  if (light.kind === "spot") {
    const [inner, outer] = [light.inner, light.outer].map((degrees) => Math.cos((degrees * Math.PI) / 180));
    const [across, up] = light.profile === undefined ? levelSides(back) : profileFrame(unit(aim(light)), light.roll);
    const settings = { ...(light.size === undefined ? {} : { shadow_soft_size: light.size }), spot_size: (light.outer * Math.PI) / 90, spot_blend: Math.min(1, (inner - outer) / Math.max(1 - outer, 1e-9)) };
    return { matrix: matrix(across, up, back, light.position), settings };
  }
  const across = unit(sides(light)[0]);
  return { matrix: matrix(across, cross(back, across), back, light.position), settings: { shape: "RECTANGLE", size: light.width, size_y: light.height } };
}

/** Columns of a light whose profile looks along its -z. */
function profileFrame(direction: Triple, roll = 0): [Triple, Triple, Triple] {
  const [across, up] = profileAxes(direction, (roll * Math.PI) / 180);
  return [across, up, direction.map((x) => -x) as unknown as Triple];
}

function matrix(x: Triple, y: Triple, z: Triple, at: Triple): number[][] {
  return [...[0, 1, 2].map((k) => [x[k], y[k], z[k], at[k]]), [0, 0, 0, 1]];
}
