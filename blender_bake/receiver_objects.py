# SPDX-License-Identifier: GPL-3.0-or-later
"""The mesh objects of a receiver: found by name, made local and real, their modifiers applied."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

from blender_bake import as_rendered, beside, elsewhere, soundness
from blender_bake.ipc import Events, WorkerError

NO_MESHES = {"CURVE", "SURFACE", "FONT", "META"}
SHEARED = 1e-5  # relative error of an object's matrix above which it has shear


def prepare(scene: bpy.types.Scene, names: list[str]) -> list[bpy.types.Object]:
    """The mesh objects of `names`, in order, each with its own data: modifiers applied, instances made real, once.

    A name is a mesh object's, or that of an empty that shows a collection, which means its renderable meshes.
    """
    objects: list[bpy.types.Object] = []
    for name in names:
        for obj in _named(scene, name):
            if obj not in objects:
                objects.append(obj)
    ready = [apply_modifiers(obj) for obj in objects]
    for obj in ready:
        if world_area(obj) <= 0:
            scale = ", ".join(f"{part:.3g}" for part in obj.matrix_world.to_scale())
            raise WorkerError(
                f"expected faces with an area on {obj.name!r}, found none at a scale of ({scale}); scale it up, and save the .blend"
            )
    return ready


def meshes_of(scene: bpy.types.Scene, collection: str, events: Events) -> list[str]:
    """Names of a collection's receivers, children included: renderable meshes, and empties that show a collection; WorkerError if none.

    A warning names objects with faces that are no meshes: they only cast shadows.
    """
    found = {c.name: c for c in [scene.collection, *scene.collection.children_recursive]}
    if collection not in found:
        shown = ", ".join(repr(name) for name in sorted(found)[:12]) + (", …" if len(found) > 12 else "")
        raise WorkerError(
            f"expected a collection {collection!r} in scene {scene.name!r}, found none; its collections are {shown}"
            f"{elsewhere.hint(scene, collection)}"
        )
    hidden = {o.name for c in found.values() if c.hide_render for o in c.all_objects}
    in_layer = {o.name for o in bpy.context.view_layer.objects}
    shown = [o for o in found[collection].all_objects if not o.hide_render and o.name not in hidden and o.name in in_layer]
    names = [o.name for o in shown if o.type == "MESH" or _shows_collection(o)]
    if others := sorted(repr(o.name) for o in shown if o.type in NO_MESHES):
        listed = ", ".join(others[:12]) + (", …" if len(others) > 12 else "")
        events.warn(f"not receivers, because they are not meshes (use Object > Convert > Mesh): {listed}")
    if not names:
        raise WorkerError(f"expected renderable meshes in collection {collection!r}, found none")
    return sorted(set(names))


def _named(scene: bpy.types.Scene, name: str) -> list[bpy.types.Object]:
    empty = scene.objects.get(name)
    if empty is not None and _shows_collection(empty):
        return _made_real(scene, _local(scene, empty))
    whole = scene.objects.get(name.partition("/")[0])
    if empty is None and whole is not None and _shows_collection(whole):  # one of an instance's meshes, as a manifest names it
        _made_real(scene, _local(scene, whole))
    return [find_mesh_object(scene, name)]


def _shows_collection(obj: bpy.types.Object) -> bool:
    return obj.type == "EMPTY" and obj.instance_type == "COLLECTION" and obj.instance_collection is not None


def _made_real(scene: bpy.types.Scene, empty: bpy.types.Object) -> list[bpy.types.Object]:
    """Objects in place of the instances of a collection, nested ones too, named EMPTY/OBJECT; its renderable meshes."""
    for obj in list(empty.instance_collection.all_objects):  # a change of visibility drops the list
        obj.hide_viewport = obj.hide_render  # what is made real is what the viewport would show
    _show(empty)
    select([empty])
    places = _places_of_instances(empty)
    before = set(scene.objects)
    if bpy.ops.object.duplicates_make_real() != {"FINISHED"}:
        raise WorkerError(f"Blender could not make the instances of {empty.name!r} real")
    made = sorted((obj for obj in scene.objects if obj not in before), key=lambda obj: obj.name)
    for obj in made:
        _place_exactly(obj, places)
        stem, _, number = obj.name.rpartition(".")
        obj.name = f"{empty.name}/{stem if number.isdecimal() and stem else obj.name}"
    meshes = [find_mesh_object(scene, obj.name) for obj in made if obj.type == "MESH" and not obj.hide_render]
    if not meshes:
        raise WorkerError(f"expected renderable meshes in the collection that {empty.name!r} shows, found none")
    return meshes


def _places_of_instances(empty: bpy.types.Object) -> list[tuple[bpy.types.ID | None, Matrix]]:
    """(data, place in the world) of everything that an empty's collection shows."""
    return [
        (one.object.original.data, one.matrix_world.copy())
        for one in bpy.context.evaluated_depsgraph_get().object_instances
        if one.is_instance and one.parent and one.parent.original == empty
    ]


def _place_exactly(obj: bpy.types.Object, places: list[tuple[bpy.types.ID | None, Matrix]]) -> None:
    """Give an object made real its instance's transform, shear included: Blender gives it only a location, a rotation and a scale."""
    bpy.context.view_layer.update()
    own = np.array(obj.matrix_world)
    errors = [(float(np.abs(np.array(place) - own).max()), place) for data, place in places if data == obj.data]
    if errors:
        error, place = min(errors, key=lambda pair: pair[0])
        if error > SHEARED * float(np.abs(own[:3, :3]).max()):
            beside.place_at(obj, place)


def require_object(scene: bpy.types.Scene, name: str) -> None:
    """WorkerError where the scene has no object `name`, nor an empty that shows it as EMPTY/OBJECT."""
    if scene.objects.get(name) is None and scene.objects.get(name.partition("/")[0]) is None:
        find_mesh_object(scene, name)


def find_mesh_object(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    """The object `name` of the scene, made local and visible; WorkerError says what else there is."""
    obj = scene.objects.get(name)
    if obj is None:
        meshes = sorted(o.name for o in scene.objects if o.type == "MESH")
        shown = ", ".join(repr(n) for n in meshes[:12]) + (", …" if len(meshes) > 12 else "")
        raise WorkerError(
            f"expected an object {name!r} in scene {scene.name!r}, found none; its meshes are {shown or 'none'}"
            f"{elsewhere.hint(scene, name)}"
        )
    if obj.type != "MESH":
        raise WorkerError(
            f"expected a mesh object, found {name!r} of type {obj.type}; a curve or text: Object > Convert > Mesh, and save the .blend"
        )
    if obj.hide_render:
        raise WorkerError(f"expected {name!r} to be renderable, found it disabled in renders; enable its camera icon and save the .blend")
    obj = _local(scene, obj)
    _show(obj)
    if not obj.visible_get():
        raise WorkerError(f"expected {name!r} to be visible, found its collection excluded or hidden; show it and save the .blend")
    return obj


def _local(scene: bpy.types.Scene, obj: bpy.types.Object) -> bpy.types.Object:
    """The object made local: its linked collections first, or the original would remain beside its copy."""
    if not (obj.library or obj.override_library):
        return obj
    for collection in scene.collection.children_recursive:
        if collection.library and obj.name in collection.all_objects:
            collection.make_local()
    return obj.make_local() or scene.objects[obj.name]


def _show(obj: bpy.types.Object) -> None:
    obj.hide_viewport = False
    obj.hide_select = False
    obj.hide_set(False)


def apply_modifiers(obj: bpy.types.Object) -> bpy.types.Object:
    """The object with its evaluated mesh, at render settings, as data: otherwise every bake would evaluate it again.

    Objects that shared a mesh each get their own texels. What an object shows beside its mesh is kept on another object, see `beside`.
    An object that consists of instances of geometry nodes alone becomes their mesh.
    """
    scene = bpy.context.scene
    soundness.require_finite(obj, obj.data)
    as_rendered.for_evaluation(obj, scene)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    more = beside.shown_by(obj, depsgraph)
    mesh = bpy.data.meshes.new_from_object(obj.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph)
    real = None if mesh.polygons or not more else beside.real_mesh(obj)
    mesh = real or mesh
    if not mesh.polygons:
        raise WorkerError(f"expected faces to bake on {obj.name!r}, found a mesh without any; bake the objects that it scatters instead")
    soundness.require_finite(obj, mesh, " after its modifiers")
    if more:
        return beside.set_apart(obj, mesh, more, instances_too=real is None)
    obj.modifiers.clear()
    obj.data = mesh
    return obj


def select(objects: list[bpy.types.Object]) -> None:
    """Select these objects alone, for Blender's operators; the first is the active one."""
    bpy.context.view_layer.update()  # selecting would rebuild the layer while its objects are iterated, and leave None among them
    for other in tuple(bpy.context.view_layer.objects):
        other.select_set(False)
    for obj in objects:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]


def world_area(obj: bpy.types.Object) -> float:
    """Area of the object's triangles in the world, square meters."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    vertices = np.empty(len(mesh.loop_triangles) * 3, np.int32)
    mesh.loop_triangles.foreach_get("vertices", vertices)
    points = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", points)
    corners = (points.reshape(-1, 3) @ np.array(obj.matrix_world.to_3x3(), np.float64).T)[vertices].reshape(-1, 3, 3)
    return float(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2)
