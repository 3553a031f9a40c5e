# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's own lights by name: light objects, emissive objects and the world, each by itself or in groups, one of them on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np

from blender_bake import elsewhere, instanced_lights
from blender_bake.emission_switch import EmissionSwitch, emits
from blender_bake.instanced_lights import Origin
from blender_bake.ipc import WorkerError
from blender_bake.own_world import OwnWorld
from blender_bake.receiver_objects import _local
from blender_bake.scene_file import show_as_rendered

SHOWN = 12  # names in an error
KINDS = {"object": "library", "collection": "collection", "world": "world", "material": "material"}  # and the words where names clash


@dataclass
class _Entry:
    """What one name means: names of objects, data of light objects with their energy, a switch of emission, the world."""

    objects: dict[str, None] = field(default_factory=dict)
    lights: list[tuple[bpy.types.Light, float]] = field(default_factory=list)
    emission: EmissionSwitch | None = None
    world: OwnWorld | None = None

    def set(self, on: bool) -> None:
        for data, energy in self.lights:
            data.energy = energy if on else 0.0
        for switch in (self.emission, self.world):
            if switch is not None:
                switch.set(on)


class NamedLights:
    """All that shines in the scene, by name; all of it is on when this is made.

    A name is that of a light object or of an object that emits, that of the world, or one of `groups`: a collection whose lights count as
    one, children included. A light of a collection that an empty shows has the empty's name, or EMPTY/LIGHT where it shows several; what
    particles or geometry nodes scatter is one light. An emissive material that geometry nodes set has its object's name, or its own where
    several objects show it. Where names clash, the kind follows: "Lobby (collection)", "World (world)".

    Strengths are those of the current frame: animation of lights, world and emissive materials stops there. Emissive objects get materials
    of their own. Must be made before a receiver is, and in place of `scene.OwnLight` and `emission.switch_off`. WorkerError for groups
    that are unknown, hold no light, or share one.
    """

    def __init__(self, scene: bpy.types.Scene, groups: list[str]) -> None:
        self._scene = scene
        show_as_rendered(scene)
        self._emits: dict[bpy.types.Material, bool] = {}
        for obj in [obj for obj in scene.objects if (obj.library or obj.override_library) and self._shines(obj)]:
            _local(scene, obj)  # the materials of what is linked cannot be changed
        self._groups_of = _members(scene, groups)
        self._origins = instanced_lights.make_own(scene, self._shines)
        self._found: dict[tuple[str, Any], _Entry] = {}  # by kind and what it is
        self._materials: dict[tuple[int, bpy.types.Material], bpy.types.Material] = {}
        self._switch = EmissionSwitch()
        self._world = OwnWorld(scene)
        self._collect()
        for name in groups:
            if ("collection", name) not in self._found:
                raise WorkerError(f"expected a light in collection {name!r}, found none that renders; name another `light_group`")
        self._entries = dict(sorted(self._by_name().items()))
        self._shining = list(self._entries.values())
        self._world.set(self._world.is_lit)

    def entries(self) -> list[dict[str, Any]]:
        """{name, objects: their names} of every light, in order of name; names are unique."""
        return [{"name": name, "objects": list(entry.objects)} for name, entry in self._entries.items()]

    def aim(self, name: str | None) -> None:
        """Let the light `name` alone shine, as the scene has it; None: no light. WorkerError for an unknown one."""
        if name is not None and name not in self._entries:
            raise WorkerError(f"expected a light {name!r} in scene {self._scene.name!r}, found {_listed(self._entries)}; bake it again")
        self._shine([] if name is None else [self._entries[name]])

    def all_on(self) -> None:
        """Let all lights shine: the scene's own light."""
        self._shine(list(self._entries.values()))

    def _shine(self, wanted: list[_Entry]) -> None:
        kept = {id(entry) for entry in wanted}
        for entry in self._shining:
            if id(entry) not in kept:
                entry.set(False)
        for entry in wanted:
            entry.set(True)
        self._shining = wanted

    def _shines(self, obj: bpy.types.Object) -> bool:
        return obj.type == "LIGHT" or any(slot.material is not None and self._emitting(slot.material) for slot in obj.material_slots)

    def _emitting(self, material: bpy.types.Material) -> bool:
        if material not in self._emits:
            self._emits[material] = emits(material)
        return self._emits[material]

    def _collect(self) -> None:
        by_nodes: dict[bpy.types.Material, list[bpy.types.Object]] = {}
        lights, emitters = self._rendered()
        for obj in lights:
            data = _own_data(obj)
            if data.energy != 0 and any(data.color):
                self._entry_of(obj).lights.append((data, data.energy))
        for obj, materials in emitters.items():
            for material in materials - {slot.material for slot in obj.material_slots}:
                by_nodes.setdefault(material, []).append(obj)
            for slot in [slot for slot in obj.material_slots if slot.material in materials]:
                source = slot.material
                slot.link = "OBJECT"  # of this object alone, whoever shares its mesh
                slot.material = self._switched(self._entry_of(obj), source)
        for material in sorted(by_nodes, key=_full_name):
            owners = by_nodes[material]
            entry = self._entry_of(owners[0]) if len(owners) == 1 else self._entry("material", material)
            entry.objects |= {obj.name: None for obj in owners}
            self._emission_of(entry).install(material)
        if self._world.is_lit:
            self._entry("world", self._world.name).world = self._world

    def _rendered(self) -> tuple[list[bpy.types.Object], dict[bpy.types.Object, set[bpy.types.Material]]]:
        """Light objects that render, and objects that emit with the materials by which they do; in order of name."""
        lights: dict[bpy.types.Object, None] = {}
        emitters: dict[bpy.types.Object, set[bpy.types.Material]] = {}
        seen: set[tuple[int, int]] = set()
        for instance in bpy.context.evaluated_depsgraph_get().object_instances:
            obj = instance.object
            key = (obj.original.as_pointer(), obj.data.as_pointer() if obj.data else 0)
            if key in seen or obj.hide_render or not (instance.is_instance or instance.show_self):
                continue
            seen.add(key)
            if obj.type == "LIGHT":
                if not getattr(obj.data.cycles, "is_portal", False):
                    lights[obj.original] = None
            elif shining := {material for material in _used(obj) if self._emitting(material)}:
                emitters.setdefault(obj.original, set()).update(shining)
        return sorted(lights, key=_full_name), {obj: emitters[obj] for obj in sorted(emitters, key=_full_name)}

    def _switched(self, entry: _Entry, material: bpy.types.Material) -> bpy.types.Material:
        """The entry's own copy of a material."""
        key = (id(entry), material)
        if key not in self._materials:
            self._materials[key] = material.copy()
            self._emission_of(entry).install(self._materials[key])
        return self._materials[key]

    def _emission_of(self, entry: _Entry) -> EmissionSwitch:
        entry.emission = entry.emission or EmissionSwitch(self._switch)
        return entry.emission

    def _entry_of(self, obj: bpy.types.Object) -> _Entry:
        """The entry of an object: its group's, or its own."""
        origin = self._origins.get(obj, Origin((obj.name,), (obj,)))
        shown = "/".join(origin.path)
        groups = sorted({group for one in origin.objects for group in self._groups_of.get(one, ())})
        if len(groups) > 1:
            raise WorkerError(
                f"expected {shown!r} in one `light_group` at most, found it in {' and '.join(repr(group) for group in groups)}; drop one"
            )
        entry = self._entry("collection", groups[0]) if groups else self._entry("object", obj)
        entry.objects[shown] = None
        return entry

    def _entry(self, kind: str, key: Any) -> _Entry:
        return self._found.setdefault((kind, key), _Entry())

    def _by_name(self) -> dict[str, _Entry]:
        """Every entry by a name of its own."""
        shown = Counter(self._origins[key].path[0] for kind, key in self._found if kind == "object" and key in self._origins)
        named: dict[str, _Entry] = {}
        for kind, word in KINDS.items():
            for (of_kind, key), entry in self._found.items():
                if of_kind != kind:
                    continue
                name = key if isinstance(key, str) else key.name
                if key in self._origins:
                    path = self._origins[key].path
                    name = path[0] if shown[path[0]] == 1 else "/".join(path)
                named[_free(name, word, named)] = entry
        return named


def _free(name: str, word: str, taken: dict[str, Any]) -> str:
    """The name, with a word where it is taken, and a number where that is."""
    if name not in taken:
        return name
    candidate, number = f"{name} ({word})", 2
    while candidate in taken:
        candidate, number = f"{name} ({word} {number})", number + 1
    return candidate


def _members(scene: bpy.types.Scene, groups: list[str]) -> dict[bpy.types.Object, list[str]]:
    """The groups of every object that is in one, children included; a group may be a collection that empties alone show."""
    found = {collection.name: collection for collection in [*bpy.data.collections, scene.collection]}
    members: dict[bpy.types.Object, list[str]] = {}
    for name in dict.fromkeys(groups):
        if name not in found:
            raise WorkerError(
                f"expected a collection {name!r} for `light_group`, found none; there are {_listed(found)}{elsewhere.hint(scene, name)}"
            )
        for obj in found[name].all_objects:
            members.setdefault(obj, []).append(name)
    return members


def _used(obj: bpy.types.Object) -> Iterator[bpy.types.Material]:
    """The materials of the file that an evaluated object shows."""
    of_object = [slot.material for slot in obj.material_slots]
    of_data = list(getattr(obj.data, "materials", None) or ())
    count = max(len(of_object), len(of_data))
    of_object, of_data = (materials + [None] * (count - len(materials)) for materials in (of_object, of_data))
    materials = [own or other for own, other in zip(of_object, of_data, strict=True)]
    if obj.type == "MESH" and count > 1:
        faces = np.empty(len(obj.data.polygons), np.int32)
        obj.data.polygons.foreach_get("material_index", faces)
        materials = [materials[i] for i in np.unique(np.clip(faces, 0, count - 1))]
    return (material.original for material in materials if material is not None)


def _own_data(obj: bpy.types.Object) -> bpy.types.Light:
    """The data of a light object, used by no other, at the strength of the current frame."""
    if obj.data.users > 1:
        obj.data = obj.data.copy()
    obj.data.animation_data_clear()
    if obj.data.node_tree is not None:
        obj.data.node_tree.animation_data_clear()
    return obj.data


def _full_name(block: bpy.types.ID) -> str:
    return str(block.name_full)


def _listed(names: Iterable[str]) -> str:
    shown = sorted(names)
    return ", ".join(repr(name) for name in shown[:SHOWN]) + (", …" if len(shown) > SHOWN else "") if shown else "none"
