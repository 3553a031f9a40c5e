# SPDX-License-Identifier: GPL-3.0-or-later
"""The surfaces of a scene as small triangles with their diffuse albedo, and the triangles that cast shadows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import bpy
import numpy as np

from blender_bake.emission_switch import emits
from blender_bake.fragment_albedo import EMISSION, GRAY, Attributes, Kinds, even_albedo, faces_front, varies, varying_albedo
from blender_bake.ipc import Events, WorkerError
from blender_bake.lobes import is_layered
from blender_bake.reflected import lets_light_through, reflection_alone
from blender_bake.scene_file import Shown, corners_of, rendered, show_as_rendered
from blender_bake.translucency import _passes
from blender_bake.without_triangles import is_only_volume

Gloss = Literal["none", "diffuse", "apart"]
GRAZING = 0.03  # of what a layer lets through along the normal, how much it reflects from all around: Schlick's term, 0.05 of the smooth
LEAST_BELOW = 0.05  # of light that passes a layer
MOST = 400_000  # fragments, unless the scene has more triangles
PER_SQUARE = 6.0  # fragments per square of the longest edge, about
PARTS = 2  # halvings of every edge of a fragment whose emission varies: textures are finer than fragments
SCALES = 20  # steps of scale, per factor e, within which instances are divided in the same way


@dataclass
class _Shape:
    """An evaluated mesh: its T triangles in its own frame (T, 3, 3), slots (T,) of materials, attributes where these vary, a matrix."""

    corners: np.ndarray
    slots: np.ndarray
    materials: list[bpy.types.Material | None]
    attributes: Attributes | None
    matrix: np.ndarray
    parents: np.ndarray
    weights: np.ndarray
    albedo: np.ndarray
    gloss: np.ndarray
    emission: np.ndarray
    one_sided: np.ndarray
    transmission: np.ndarray


@dataclass(frozen=True)
class _Placed:
    """A shape in the world, by the key of the shape."""

    name: str
    key: tuple[Any, ...]
    matrix: np.ndarray


def area(scene: bpy.types.Scene) -> float:
    """Of all surfaces that `fragments` gives, one side of each, square meters."""
    show_as_rendered(scene)
    shapes, placed, _ = _read_scene()
    return sum(float(_areas(_moved(shapes[one.key].corners, one.matrix)).sum()) for one in placed)


def occluders(scene: bpy.types.Scene) -> np.ndarray:
    """(O, 3, 3) float32: the triangles that cast shadows and are of no material that light passes."""
    show_as_rendered(scene)
    return np.concatenate([np.zeros((0, 3, 3), np.float32), *_read_scene()[2]])


def fragments(scene: bpy.types.Scene, longest: float, events: Events, gloss: Gloss = "none") -> dict[str, Any]:
    """All surfaces that render and that diffuse rays see, as T fragments: triangles with no edge longer than `longest` meters.

    corners (T, 3, 3) float32 in the world, wound so that normals point as they render; albedo (T, 3) float32, diffuse color by Cycles: 0 of
    metal, glass and black, without translucency, of gloss `diffuse` also what gloss reflects, as if it were diffuse; of gloss `apart` that
    is in `gloss` (T, 3) float32, beyond the albedo, which then is that of a path without gloss; transmission (T, 3) float32, what
    translucent materials let through diffusely; object (T,) int32 of `names`, a list; transparent
    (T,) bool: of a material that light passes; occluders (O, 3, 3) float32: the undivided triangles that cast shadows and are not
    transparent; emission (T, 3) float32, radiance of the front, and one_sided (T,) bool: of a material whose back may emit less, see
    `faces_front`; longest: the longest edge in fact, larger where the scene would have had more than 400,000 fragments. Ends the use of the
    scene: objects are hidden. WorkerError where nothing renders.
    """
    show_as_rendered(scene)
    shapes, placed, occluders = _read_scene()
    if not placed:
        raise WorkerError(f"expected objects that render in scene {scene.name!r}, found none; enable them in renders and save the .blend")
    divided = _divide(shapes, placed, longest)
    if divided > 1.001 * longest:
        events.warn(f"the surfaces are divided into triangles of {divided:.3g} m in place of {longest:.3g} m: the scene is large")
    with reflection_alone():
        transparent = _color(scene, shapes, gloss)
    _let_through(scene, shapes, gloss != "none")
    _shine(scene, shapes)
    names = list(dict.fromkeys(one.name for one in placed))
    numbers = {name: i for i, name in enumerate(names)}
    corners = []
    for one in placed:
        shape = shapes[one.key]
        moved = _moved(np.einsum("fij,fjk->fik", shape.weights, shape.corners[shape.parents]), one.matrix)
        mirrored = np.linalg.det(one.matrix[:3, :3]) < 0
        corners.append((moved[:, ::-1] if mirrored else moved).astype(np.float32))
    return {
        "corners": np.concatenate(corners),
        "albedo": np.concatenate([shapes[one.key].albedo for one in placed]).astype(np.float32),
        "transmission": np.concatenate([shapes[one.key].transmission for one in placed]).astype(np.float32),
        **({"gloss": np.concatenate([shapes[one.key].gloss for one in placed]).astype(np.float32)} if gloss == "apart" else {}),
        "object": np.concatenate([np.full(len(part), numbers[one.name], np.int32) for part, one in zip(corners, placed, strict=True)]),
        "names": names,
        "transparent": np.concatenate([transparent[one.key] for one in placed]),
        "emission": np.concatenate([shapes[one.key].emission for one in placed]).astype(np.float32),
        "one_sided": np.concatenate([shapes[one.key].one_sided for one in placed]),
        "occluders": np.concatenate([np.zeros((0, 3, 3), np.float32), *occluders]),
        "longest": divided,
    }


def split(corners: np.ndarray, longest: float) -> tuple[np.ndarray, np.ndarray]:
    """(which triangle (F,), barycentric coordinates of the corners (F, 3, 3)) of fragments of the triangles (T, 3, 3).

    The longest edge is halved, again and again, while it is longer than `longest`: thin triangles do not get thinner. Windings stay.
    """
    parents, weights = np.arange(len(corners)), np.broadcast_to(np.eye(3), (len(corners), 3, 3))
    done_parents, done_weights = [], []
    while len(parents):
        places = np.einsum("fij,fjk->fik", weights, corners[parents])
        edges = np.linalg.norm(np.roll(places, -1, axis=1) - places, axis=2)
        long = edges.max(axis=1) > longest
        done_parents.append(parents[~long])
        done_weights.append(weights[~long])
        parents, weights, edges = parents[long], weights[long], edges[long]
        order = (edges.argmax(axis=1)[:, None] + np.arange(3)) % 3  # the longest edge from the first corner to the second
        first, second, third = np.moveaxis(np.take_along_axis(weights, order[:, :, None], axis=1), 1, 0)
        middle = (first + second) / 2
        weights = np.concatenate([np.stack([first, middle, third], axis=1), np.stack([middle, second, third], axis=1)])
        parents = np.concatenate([parents, parents])
    empty = np.zeros((0, 3, 3))
    return np.concatenate([np.zeros(0, np.intp), *done_parents]), np.concatenate([empty, *done_weights])


def _divide(shapes: dict[tuple[Any, ...], _Shape], placed: list[_Placed], longest: float) -> float:
    """Set every shape's division; the longest edge in fact."""
    counts = dict.fromkeys(shapes, 0)
    for one in placed:
        counts[one.key] += 1
    worlds = {key: _moved(shape.corners, shape.matrix) for key, shape in shapes.items()}
    whole = sum(counts[key] * float(_areas(world).sum()) for key, world in worlds.items())
    least = sum(counts[key] * len(world) for key, world in worlds.items())
    longest = max(longest, (PER_SQUARE * whole / MOST) ** 0.5)
    while True:
        for key, shape in shapes.items():
            shape.parents, shape.weights = split(worlds[key], longest)
        total = sum(counts[key] * len(shape.parents) for key, shape in shapes.items())
        if total <= max(MOST, 1.2 * least):
            return longest
        longest *= 1.05 * max(1.0, (total / max(MOST, least)) ** 0.5)


def _color(scene: bpy.types.Scene, shapes: dict[tuple[Any, ...], _Shape], gloss: Gloss) -> dict[tuple[Any, ...], np.ndarray]:
    """Set every shape's albedo, and its gloss where that is apart; which fragments are transparent, by shape.

    A Principled surface has its specular lobe over its diffuse one, which it dims; Cycles' passes show both along the normal. Where
    paths from diffuse surfaces have no gloss (caustics are off), it dims nothing there.
    """
    passing = {m: m is not None and bool(m.use_nodes and m.node_tree and _passes(m)) for m in _used(shapes)}
    transparent = {}
    glossy = {} if gloss == "none" else _colors(scene, shapes, ("GLOSSY",))
    for key, albedo in _colors(scene, shapes, ("DIFFUSE",)).items():
        shape = shapes[key]
        shape.albedo, shape.gloss = albedo, np.zeros_like(albedo)
        if gloss != "none":
            over = np.array([is_layered(material) for material in shape.materials])[shape.slots[shape.parents]][:, None]
            lobe = glossy[key]
            bare = np.where(over, np.minimum(albedo / np.maximum(1 - lobe, LEAST_BELOW), 1), albedo)
            lobe = np.where(over & (lobe > 0), lobe + (1 - lobe) * GRAZING, lobe)
            extra = np.where(over, lobe * (1 - bare), np.minimum(lobe, 1 - bare))
            shape.albedo, shape.gloss = (bare + extra, shape.gloss) if gloss == "diffuse" else (bare, extra)
        transparent[key] = np.array([passing.get(material, False) for material in shape.materials])[shape.slots[shape.parents]]
    return transparent


def _let_through(scene: bpy.types.Scene, shapes: dict[tuple[Any, ...], _Shape], gloss: bool) -> None:
    """Set what every shape lets through diffusely; with `gloss` the shapes' albedo has more in it than diffuse reflection."""
    some = {}
    for key, shape in shapes.items():
        shape.transmission = np.zeros((len(shape.parents), 3))
        if any(lets_light_through(shape.materials[slot]) for slot in np.unique(shape.slots)):
            some[key] = shape
    if not some:
        return
    reflected = {key: shape.albedo for key, shape in some.items()}
    if gloss:
        with reflection_alone():
            reflected = _colors(scene, some, ("DIFFUSE",))
    for key, color in _colors(scene, some, ("DIFFUSE",)).items():
        some[key].transmission = np.maximum(color - reflected[key], 0)


def _colors(scene: bpy.types.Scene, shapes: dict[tuple[Any, ...], _Shape], kinds: Kinds) -> dict[tuple[Any, ...], np.ndarray]:
    """The color (F, 3) of every shape's fragments."""
    even = even_albedo(scene, [material for material in _used(shapes) if material is not None and not varies(material)], kinds)
    found = {}
    for key, shape in shapes.items():
        slots = shape.slots[shape.parents]
        found[key] = np.array([even.get(material, np.full(3, GRAY)) for material in shape.materials])[slots]
        if shape.attributes is not None:
            varying = np.array([varies(material) for material in shape.materials])[slots]
            parents, weights = shape.parents[varying], shape.weights[varying]
            corners = np.einsum("fij,fjk->fik", weights, shape.corners[parents])
            attributes = _interpolated(shape.attributes, parents, weights)
            found[key][varying] = varying_albedo(scene, corners, slots[varying], shape.materials, attributes, shape.matrix, kinds)
    return found


def _used(shapes: dict[tuple[Any, ...], _Shape]) -> list[bpy.types.Material | None]:
    return list(dict.fromkeys(shape.materials[slot] for shape in shapes.values() for slot in np.unique(shape.slots)))


def _shine(scene: bpy.types.Scene, shapes: dict[tuple[Any, ...], _Shape]) -> None:
    """Set what every shape emits."""
    emitting = [material for material in _used(shapes) if material is not None and emits(material)]
    fronts = {material: faces_front(material) for material in emitting}
    even = even_albedo(scene, [material for material in emitting if not varies(material)], EMISSION)
    cuts = _subdivision(PARTS)
    for shape in shapes.values():
        slots = shape.slots[shape.parents]
        shape.emission = np.array([even.get(material, np.zeros(3)) for material in shape.materials])[slots]
        shape.one_sided = np.array([fronts.get(material, False) for material in shape.materials])[slots]
        varying = np.array([material in fronts and material not in even for material in shape.materials])[slots]
        if varying.any():
            assert shape.attributes is not None
            parents = np.repeat(shape.parents[varying], len(cuts))
            weights = np.einsum("cij,fjk->fcik", cuts, shape.weights[varying]).reshape(-1, 3, 3)
            corners = np.einsum("fij,fjk->fik", weights, shape.corners[parents])
            attributes = _interpolated(shape.attributes, parents, weights)
            within = np.repeat(slots[varying], len(cuts))
            found = varying_albedo(scene, corners, within, shape.materials, attributes, shape.matrix, EMISSION)
            shape.emission[varying] = found.reshape(-1, len(cuts), 3).mean(axis=1)


def _subdivision(times: int) -> np.ndarray:
    """(4 ** times, 3, 3): barycentric coordinates of the corners of equal parts of a triangle, every edge halved so many times."""
    parts = np.eye(3)[None]
    for _ in range(times):
        first, second, third = np.moveaxis(parts, 1, 0)
        ab, bc, ca = (first + second) / 2, (second + third) / 2, (third + first) / 2
        parts = np.concatenate([np.stack(part, axis=1) for part in ((first, ab, ca), (ab, second, bc), (ca, bc, third), (ab, bc, ca))])
    return parts


def _interpolated(attributes: Attributes, parents: np.ndarray, weights: np.ndarray) -> Attributes:
    def at(values: np.ndarray) -> np.ndarray:
        return np.einsum("fij,fjc->fic", weights, values.reshape(-1, 3, values.shape[1])[parents]).reshape(-1, values.shape[1])

    uv, colors, values = ({name: at(rows) for name, rows in part.items()} for part in (attributes.uv, attributes.colors, attributes.values))
    return Attributes(uv, colors, values, attributes.rendered_uv, attributes.rendered_color, attributes.texture_space)


def _read_scene() -> tuple[dict[tuple[Any, ...], _Shape], list[_Placed], list[np.ndarray]]:
    """Shapes by key, where they are placed, and triangles (O, 3, 3) that cast shadows."""
    shapes: dict[tuple[Any, ...], _Shape] = {}
    placed: list[_Placed] = []
    occluders: list[np.ndarray] = []
    for shown in rendered():
        obj = shown.object
        if not (obj.visible_diffuse or obj.visible_shadow):
            continue
        mesh = obj.to_mesh()
        if mesh is None:
            continue
        for shape, key in _of_mesh(shown, mesh, shapes):
            world = _moved(shape.corners, shown.matrix)
            if obj.visible_diffuse:
                shapes[key] = shape
                placed.append(_Placed(shown.name, key, shown.matrix))
            if obj.visible_shadow:
                opaque = np.array([not (m and m.use_nodes and m.node_tree and _passes(m)) for m in shape.materials])[shape.slots]
                occluders.append(world[opaque].astype(np.float32))
        obj.to_mesh_clear()
    return shapes, placed, occluders


def _of_mesh(shown: Shown, mesh: bpy.types.Mesh, shapes: dict[tuple[Any, ...], _Shape]) -> Iterator[tuple[_Shape, tuple[Any, ...]]]:
    """The shape of an evaluated mesh, if it has sound triangles with a surface, and its key: instances of about one size share one."""
    sizes = np.linalg.svd(shown.matrix[:3, :3], compute_uv=False)
    scale = tuple(np.round(SCALES * np.log(np.maximum(sizes, 1e-12))).astype(int).tolist())
    key = (shown.object.name_full, mesh.name, len(mesh.loops), len(mesh.vertices), scale)
    if key in shapes:
        yield shapes[key], key
        return
    found = corners_of(mesh, np.eye(4))
    materials = _materials(shown.object, mesh)
    slots = np.minimum(found.materials, len(materials) - 1)
    corners = found.places.reshape(-1, 3, 3).astype(np.float64)
    solid = np.array([material is None or not is_only_volume(material) for material in materials])
    kept = np.isfinite(_moved(corners, shown.matrix)).all(axis=(1, 2)) & solid[slots]
    if not kept.any():
        return
    attributes = None
    if any(varies(materials[slot]) for slot in np.unique(slots[kept])):
        faces = np.empty(len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("polygon_index", faces)
        attributes = Attributes.of(mesh, found.loops.reshape(-1, 3)[kept].ravel(), faces[kept])
    nothing = np.zeros(0)
    yield _Shape(corners[kept], slots[kept], materials, attributes, shown.matrix, *(nothing,) * 7), key


def _materials(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> list[bpy.types.Material | None]:
    """The file's materials of the slots, the object's own before the mesh's; at least one."""
    of_object, of_mesh = [slot.material for slot in obj.material_slots], list(mesh.materials)
    count = max(len(of_object), len(of_mesh), 1)
    of_object, of_mesh = (found + [None] * (count - len(found)) for found in (of_object, of_mesh))
    chosen = [own or other for own, other in zip(of_object, of_mesh, strict=True)]
    return [None if material is None else material.original for material in chosen]


def _moved(corners: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    return corners @ matrix[:3, :3].T.astype(np.float64) + matrix[:3, 3]


def _areas(corners: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
