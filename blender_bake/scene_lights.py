# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's own lights as values: kind, place, color and size of each, in the units of a FRAMES.json."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

from blender_bake.light import AREA_WATTS, POINT_WATTS
from blender_bake.light_frame import roll_of
from blender_bake.node_values import Place, source, value
from blender_bake.scene_file import rendered, show_as_rendered

DIGITS = 7  # significant ones: Blender's numbers are single floats
SMALL = 1e-6  # m: a size up to which a light is a point
UNEVEN = 1e-3  # relative difference of an object's scales from which a spot's cone is elliptical
FULL_SPREAD = math.pi - 1e-3  # rad: of an area light that is diffuse
MOST_IES = 1 << 22  # bytes of a photometric file
ROUND_SIDE = math.sqrt(math.pi) / 2  # side of a square of the area of a disk of diameter 1


class _CannotError(Exception):
    """Why a light has no counterpart."""


def values(scene: bpy.types.Scene) -> dict[str, Any]:
    """`lights`: [{name, light, note}] of every light object that renders and shines, in order of name, as FRAMES.json writes lights;
    `profiles`: the text of IES files by the name that a light's `profile` has.

    `left_out`: [{name, reason}] of those without a counterpart. `note`: what the values lack, where they lack anything. `sun_angle`:
    angular diameter (rad) of the brightest sun, None without one. A light of an instance is named INSTANCER/LIGHT; names are unique.
    Values are those of the current frame. The world and emissive objects are no light objects.
    """
    show_as_rendered(scene)
    found: list[tuple[str, dict[str, Any], list[str]]] = []
    left_out: list[dict[str, Any]] = []
    taken: set[str] = set()
    profiles: dict[str, str] = {}
    names = sorted({one.name for one in rendered()})
    graph = bpy.context.evaluated_depsgraph_get()
    shown = [
        (_name(instance), instance.object.original.name, instance.matrix_world.copy())
        for instance in graph.object_instances
        if instance.object.type == "LIGHT" and not instance.object.hide_render and (instance.is_instance or instance.show_self)
    ]
    for name, original, matrix in sorted(shown, key=lambda one: (one[0], *one[2].translation)):
        obj = bpy.data.objects[original].evaluated_get(graph)
        unique = _free(name, taken)
        taken.add(unique)
        try:
            light, notes, profile = _light(scene, obj, matrix, names)
        except _CannotError as reason:
            left_out.append({"name": unique, "reason": str(reason)})
            continue
        if light is not None:
            if profile is not None:
                light["profile"] = _stored(profile, unique, profiles)
            found.append((unique, light, notes))
    suns = [(max(light["color"]), light["angle"]) for _, light, _ in found if light["kind"] == "directional"]
    lights = [{"name": name, "light": light, **({"note": "; ".join(notes)} if notes else {})} for name, light, notes in found]
    return {
        "lights": lights,
        "left_out": left_out,
        "sun_angle": max(suns)[1] if suns else None,
        **({"profiles": profiles} if profiles else {}),
    }


def _light(
    scene: bpy.types.Scene, obj: bpy.types.Object, matrix: Matrix, names: Sequence[str]
) -> tuple[dict[str, Any] | None, list[str], str | None]:
    """The light, what it lacks, the text of its IES file; None where it does not shine. _CannotError where there is no counterpart."""
    data = obj.data
    if data.cycles.is_portal and data.type == "AREA":
        raise _CannotError("a portal shows the world")
    color, profile = _strength(data)
    if not any(color):
        return None, [], None
    if min(color) < 0:
        raise _CannotError("its power is negative")
    if not data.use_shadow:
        raise _CannotError("it casts no shadows")
    if not obj.visible_diffuse:
        raise _CannotError("it is hidden from diffuse rays")
    bounces = data.cycles.max_bounces
    notes = [f"its light bounces at most {bounces} times in Cycles"] if bounces < scene.cycles.max_bounces else []
    light = {"POINT": _point, "SPOT": _spot, "SUN": _sun, "AREA": _area}[data.type](data, matrix, color, notes)
    if profile is not None:
        if matrix.is_negative:
            raise _CannotError("its object is mirrored, and so would its IES texture be")
        direction = _triple(_axis(matrix))
        light |= {"direction": direction, "roll": _rounded(roll_of(Vector(direction), matrix))}
    return light | _links(obj, names), notes, profile


def _links(obj: bpy.types.Object, names: Sequence[str]) -> dict[str, dict[str, list[str]]]:
    """`receivers` and `blockers` of a light, by `names` of objects that render, where its light linking chooses any."""
    linking = getattr(obj, "light_linking", None)
    collections = {} if linking is None else {"receivers": linking.receiver_collection, "blockers": linking.blocker_collection}
    found = {}
    for link, collection in collections.items():
        if collection is None:
            continue
        states: dict[str, set[str]] = {"INCLUDE": set(), "EXCLUDE": set()}
        for member, child in zip(collection.collection_children, collection.children, strict=True):
            states[member.light_linking.link_state] |= {one.name for one in child.all_objects}
        for member, one in zip(collection.collection_objects, collection.objects, strict=True):
            states[member.light_linking.link_state].add(one.name)
        kept, left = ([name for name in names if name in states[state]] for state in ("INCLUDE", "EXCLUDE"))
        if states["INCLUDE"] or left:  # an empty collection chooses all
            found[link] = {**({"only": kept} if states["INCLUDE"] else {}), **({"without": left} if left else {})}
    return found


def _strength(data: bpy.types.Light) -> tuple[np.ndarray, str | None]:
    """((3,) energy times color, in watts, or irradiance of a sun, the text of an IES file that shapes it); _CannotError where other nodes
    make it vary."""
    color = np.array(data.color, np.float64) * data.energy * 2 ** getattr(data, "exposure", 0.0)
    if getattr(data, "use_temperature", False):
        color = color * np.array(data.temperature_color, np.float64)
    if not (data.use_nodes and data.node_tree is not None and color.any()):
        return color, None
    output = data.node_tree.get_output_node("CYCLES")
    shader = None if output is None else source(Place(output.inputs["Surface"]))[1]
    if shader is None:
        return np.zeros(3), None
    factors: list[np.ndarray | None] = [None]
    profile = None
    if shader.node.type == "EMISSION":
        factors = [value(shader.input("Color"))]
        strength = shader.input("Strength")
        shape = None if strength is None else source(strength)[1]
        if shape is not None and shape.node.type == "TEX_IES":
            profile = _ies_of(data, shape)
            factors.append(value(shape.input("Strength")))
        else:
            factors.append(value(strength))
    if any(factor is None for factor in factors):
        raise _CannotError("its nodes drive it")
    for factor in factors:
        color = color * np.asarray(factor, np.float64)[:3]
    return color, profile


def _ies_of(data: bpy.types.Light, shape: Place) -> str:
    """The text of the file of an IES texture; _CannotError where it is not there, or not that of a point or a spot, in its own frame."""
    node = shape.node
    if data.type not in {"POINT", "SPOT"}:
        raise _CannotError("an IES texture shapes it: there are such point and spot lights alone")
    vector = shape.input("Vector")
    if vector is not None and source(vector)[1] is not None:
        raise _CannotError("nodes turn its IES texture")
    if node.mode == "INTERNAL":
        if node.ies is None:
            raise _CannotError("its IES texture has no file")
        return node.ies.as_string()
    path = Path(bpy.path.abspath(node.filepath, library=data.original.library))
    try:
        content = path.read_bytes() if node.filepath else b""
    except OSError as error:
        raise _CannotError(f"its IES file {path} is not read ({error.strerror})") from None
    if not content:
        raise _CannotError("its IES texture has no file")
    if len(content) > MOST_IES:
        raise _CannotError(f"its IES file {path} has more than {MOST_IES >> 20} MB")
    return content.decode("latin-1")


def _stored(text: str, light: str, profiles: dict[str, str]) -> str:
    """The name that an IES file's text has in `profiles`: that of the first light with it."""
    for name, known in profiles.items():
        if known == text:
            return name
    profiles[f"{light}.ies"] = text
    return f"{light}.ies"


def _point(data: bpy.types.Light, matrix: Matrix, color: np.ndarray, _: list[str]) -> dict[str, Any]:
    told = {"position": _triple(matrix.translation), "color": _triple(color / POINT_WATTS), "a0": 1.0, "falloff": "inverse-square"}
    _require_power(data, data.shadow_soft_size)
    if data.shadow_soft_size > SMALL:
        return {"kind": "sphere", "size": _rounded(data.shadow_soft_size), **told}
    return {"kind": "point", **told}


def _spot(data: bpy.types.Light, matrix: Matrix, color: np.ndarray, _: list[str]) -> dict[str, Any]:
    scales = [abs(scale) for scale in matrix.to_scale()]
    if max(scales) - min(scales) > UNEVEN * max(scales):
        raise _CannotError("its object is scaled unevenly, so that its cone is elliptical")
    _require_power(data, data.shadow_soft_size)
    outer = data.spot_size / 2
    edge = math.cos(outer)
    return {
        "kind": "spot",
        "position": _triple(matrix.translation),
        "direction": _triple(_axis(matrix)),
        "inner": _rounded(min(math.acos(min(1.0, edge + data.spot_blend * (1 - edge))), outer)),  # Cycles: a smoothstep in the cosine
        "outer": _rounded(outer),
        **({"size": _rounded(data.shadow_soft_size)} if data.shadow_soft_size > SMALL else {}),
        "color": _triple(color / POINT_WATTS),
        "a0": 1.0,
        "falloff": "inverse-square",
    }


def _sun(data: bpy.types.Light, matrix: Matrix, color: np.ndarray, _: list[str]) -> dict[str, Any]:
    _require_power(data, data.angle)
    return {"kind": "directional", "direction": _triple(-_axis(matrix)), "color": _triple(color), "angle": _rounded(data.angle)}


def _area(data: bpy.types.Light, matrix: Matrix, color: np.ndarray, notes: list[str]) -> dict[str, Any]:
    if data.spread < FULL_SPREAD:
        raise _CannotError(f"its spread is {math.degrees(data.spread):.3g} degrees: there are area lights of 180 alone")
    sizes = (data.size, data.size_y if data.shape in {"RECTANGLE", "ELLIPSE"} else data.size)
    if data.shape in {"DISK", "ELLIPSE"}:
        sizes = (sizes[0] * ROUND_SIDE, sizes[1] * ROUND_SIDE)
        notes.append("a rectangle of equal area stands for it")
    across, up = (matrix.to_3x3().col[k] * sizes[k] for k in (0, 1))
    area = across.cross(up).length
    if area <= SMALL**2:
        raise _CannotError("it has no area")
    if across.cross(-up).dot(_axis(matrix)) < 0:  # mirrored
        across = -across
    watts = color if getattr(data, "normalize", True) else color * area
    return {
        "kind": "area",
        "position": _triple(matrix.translation),
        "u": _triple(across),
        "v": _triple(-up),
        "color": _triple(watts / AREA_WATTS),
        "a0": 1.0,
    }


def _require_power(data: bpy.types.Light, size: float) -> None:
    if not getattr(data, "normalize", True) and size > 0:
        raise _CannotError("its power depends on its size (Normalize is off)")


def _axis(matrix: Matrix) -> Vector:
    """Unit vector along which a light shines: its local -z."""
    return -matrix.to_3x3().col[2].normalized()


def _name(instance: bpy.types.DepsgraphObjectInstance) -> str:
    own = instance.object.name
    return f"{instance.parent.name}/{own}" if instance.is_instance and instance.parent is not None else own


def _free(name: str, taken: set[str]) -> str:
    candidate, number = name, 2
    while candidate in taken:
        candidate, number = f"{name} {number}", number + 1
    return candidate


def _rounded(number: float) -> float:
    return float(f"{number:.{DIGITS}g}")


def _triple(numbers: Any) -> list[float]:
    return [_rounded(float(number)) for number in numbers]
