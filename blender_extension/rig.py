# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights of a FRAMES.json that the viewer saved, written to the scene's lights of their names."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import bpy
from mathutils import Matrix, Vector

TYPES = {"directional": "SUN", "point": "POINT", "sphere": "POINT", "spot": "SPOT", "area": "AREA"}
ROUND = math.sqrt(math.pi) / 2  # side of a square of the area of a disk of diameter 1
SAME = 1e-5  # m: sides of an area that are equal
LINKS = {"receivers": "receiver_collection", "blockers": "blocker_collection"}
NOTHING = "srbf nothing"  # an object that nothing renders
OWN = "srbf_rig"  # property of collections that a file's choices made


class RigError(Exception):
    """A file that holds no lights of the viewer."""


def read(path: Path) -> dict[str, Any]:
    """The first frame of a FRAMES.json: `lights`, and `off`, names of those that do not shine. RigError for other files."""
    try:
        frame = json.loads(path.read_text(encoding="utf-8"))["frames"][0]
        if not isinstance(frame["lights"], list) or not all(isinstance(light, dict) and "kind" in light for light in frame["lights"]):
            raise TypeError
    except OSError as error:
        raise RigError(f"cannot read {path.name}: {error.strerror}") from error
    except (ValueError, KeyError, IndexError, TypeError) as error:
        raise RigError(f"expected a FRAMES.json of the viewer, found something else in {path.name}") from error
    return frame


def take(scene: bpy.types.Scene, frame: dict[str, Any]) -> tuple[int, list[str]]:
    """Set the scene's lights; (how many were set, a line for each that was not).

    Place, orientation, color, power, size, cone and visibility are set. Suns keep their place, disks their shape; suns without an `angle`
    keep theirs, spots without a `size` their radius. Lights are linked to the objects that the file names, by collections of their own;
    where it names none, those of a former file go, and the scene's own stay that no file has replaced.

    Power then includes exposure, temperature and nodes, which are off. RigError for lights without the values of their kind.
    """
    notes, count = [], 0
    nameless = sum("name" not in light for light in frame["lights"])
    if nameless:
        notes.append(f"{nameless} lights have no name: the viewer's 'Lights for Blender' makes them")
    for light in frame["lights"]:
        if "name" not in light:
            continue
        found = _light(scene, str(light["name"]), TYPES.get(light["kind"]))
        if isinstance(found, str):
            notes.append(found)
            continue
        try:
            _set(found, light)
            notes += _link(scene, found, light)
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise RigError(f"expected the values of a {light['kind']} light for {light['name']!r}, found others ({error})") from error
        found.hide_render = found.hide_viewport = False
        count += 1
    for name in frame.get("off", ()):
        found = _light(scene, str(name), None)
        if isinstance(found, str):
            notes.append(found)
            continue
        found.hide_render = found.hide_viewport = True
        count += 1
    return count, notes


def _light(scene: bpy.types.Scene, name: str, kind: str | None) -> bpy.types.Object | str:
    """The scene's light of that name, its data shared with no other; a line where it cannot be set."""
    obj = scene.objects.get(name)
    if obj is None or obj.type != "LIGHT":
        return f"{name!r} is no light of this scene"
    if kind is not None and obj.data.type != kind:
        return f"{name!r} is now a {obj.data.type.lower()} light, formerly a {kind.lower()} one"
    if obj.library or obj.data.library:
        return f"{name!r} is linked from another file"
    if obj.data.users > 1:
        obj.data = obj.data.copy()
    return obj


def _set(obj: bpy.types.Object, light: dict[str, Any]) -> None:
    data, kind = obj.data, light["kind"]
    color = [float(value) for value in light.get("color", (1, 1, 1))]
    a0, most = float(light.get("a0", 1)), max(color)
    watts = {"SUN": 1.0, "AREA": math.pi * a0**2}.get(data.type, 4 * math.pi * a0**2)
    place, turn = _placed(obj, light)
    data.use_nodes = False
    for name, plain in (("exposure", 0.0), ("use_temperature", False), ("normalize", True)):
        if hasattr(data, name):
            setattr(data, name, plain)
    data.energy = most * watts
    data.color = [value / most for value in color] if most > 0 else (1, 1, 1)
    if data.type == "POINT":
        data.shadow_soft_size = float(light["size"]) if kind == "sphere" else 0.0
    elif data.type == "SUN":
        data.angle = float(light.get("angle", data.angle))
    elif data.type == "SPOT":
        data.shadow_soft_size = float(light.get("size", data.shadow_soft_size))
        edge = math.cos(light["outer"])
        data.spot_size = 2 * light["outer"]
        data.spot_blend = min(1.0, (math.cos(light["inner"]) - edge) / max(1 - edge, 1e-9))
    elif data.type == "AREA":
        _size(data, Vector(light["u"]).length, Vector(light["v"]).length)
    obj.matrix_world = Matrix.Translation(place) @ turn.to_4x4()


def _link(scene: bpy.types.Scene, obj: bpy.types.Object, light: dict[str, Any]) -> list[str]:
    """Choose what the light shines on, and what shadows it; a line for each object that the scene lacks."""
    linking = getattr(obj, "light_linking", None)
    if linking is None:
        return []
    notes = []
    for link, place in LINKS.items():
        present, name = getattr(linking, place), f"srbf {obj.name} {link}"
        if present is not None and (present.get(OWN) or present.name == name):
            setattr(linking, place, None)
            if present.users == 0:  # no copy of the light has it
                bpy.data.collections.remove(present)
        if light.get(link) is not None:
            collection, missing = _collection(scene, name, light[link])
            setattr(linking, place, collection)
            notes += [f"{obj.name!r} is linked to {one!r}, which this scene lacks" for one in missing]
    return notes


def _collection(scene: bpy.types.Scene, name: str, choice: dict[str, list[str]]) -> tuple[bpy.types.Collection, list[str]]:
    """Of `only` some objects, `without` others; and the names that the scene lacks."""
    made = bpy.data.collections.new(name)
    made[OWN] = True
    states = dict.fromkeys(choice.get("only", ()), "INCLUDE") | dict.fromkeys(choice.get("without", ()), "EXCLUDE")
    for one in states:
        if one in scene.objects:
            made.objects.link(scene.objects[one])
    for member, one in zip(made.collection_objects, made.objects, strict=True):
        member.light_linking.link_state = states[one.name]
    if "only" in choice and not any(states[one.name] == "INCLUDE" for one in made.objects):
        made.objects.link(bpy.data.objects.get(NOTHING) or bpy.data.objects.new(NOTHING, None))  # a collection without any chooses all
    return made, [one for one in states if one not in scene.objects]


def _placed(obj: bpy.types.Object, light: dict[str, Any]) -> tuple[Vector, Matrix]:
    """Where it is, and its axes as columns."""
    if light["kind"] == "directional":
        return obj.matrix_world.translation, Vector(light["direction"]).to_track_quat("Z", "Y").to_matrix()
    place = Vector(light["position"])
    if light["kind"] == "spot":
        return place, Vector(light["direction"]).to_track_quat("-Z", "Y").to_matrix()
    if light["kind"] == "area":
        u, v = Vector(light["u"]), Vector(light["v"])
        return place, Matrix((u.normalized(), -v.normalized(), -u.cross(v).normalized())).transposed()
    return place, obj.matrix_world.to_3x3().normalized()


def _size(data: bpy.types.Light, width: float, height: float) -> None:
    even = abs(width - height) < SAME
    if data.shape in {"DISK", "ELLIPSE"}:
        data.shape = "DISK" if even and data.shape == "DISK" else "ELLIPSE"
        width, height = width / ROUND, height / ROUND
    else:
        data.shape = "SQUARE" if even and data.shape == "SQUARE" else "RECTANGLE"
    data.size, data.size_y = width, height
