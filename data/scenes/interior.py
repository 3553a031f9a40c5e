# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scenes of rooms have in common: walls around rectangular rooms, lightmap coordinates, and lights of every kind."""

import argparse

import bpy
import numpy as np
from lightmap_charts import GAP, unwrap_curved, unwrap_planes
from mathutils import Vector

# ---- shapes: a part is (points, faces) --------------------------------------------------------------------------------------


def carved(hull, rooms, blocks=(), step=1e9, outside=False):
    """The surface between free space and what is left of the box `hull` once `rooms` are cut out of it, and `blocks` put back in.

    A box is (low, high) in meters. Faces look into the free space, on a grid of cells of at most `step` that leaves no T-junctions.
    Beyond the hull all is solid, so that a room that reaches its border is closed there, or with `outside` all is free.
    """
    every = [np.asarray(corners, float) for corners in (hull, *rooms, *blocks)]
    breaks = []
    for axis in range(3):
        ends = np.unique(np.round(np.concatenate(every)[:, axis], 6))
        ends = ends[(ends >= every[0][0, axis]) & (ends <= every[0][1, axis])]
        pieces = [np.linspace(a, b, max(1, round((b - a) / step)), endpoint=False) for a, b in zip(ends, ends[1:], strict=False)]
        breaks.append(np.concatenate([*pieces, ends[-1:]]))
    middles = np.stack(np.meshgrid(*[(b[1:] + b[:-1]) / 2 for b in breaks], indexing="ij"), axis=-1)
    free = np.zeros(middles.shape[:3], bool)
    for corners, value in [*((room, True) for room in rooms), *((block, False) for block in blocks)]:
        free[np.all((middles > corners[0]) & (middles < corners[1]), axis=-1)] = value
    free = np.pad(free, 1, constant_values=outside)
    numbers, points, faces = {}, [], []

    def point(index):
        if index not in numbers:
            numbers[index] = len(points)
            points.append(Vector([breaks[axis][i] for axis, i in enumerate(index)]))
        return numbers[index]

    for axis in range(3):
        change = np.diff(free.astype(np.int8), axis=axis)
        across, up = (axis + 1) % 3, (axis + 2) % 3
        for cell in np.argwhere(change):
            if min(cell[across], cell[up]) < 1:
                continue
            corner = list(cell)
            corner[across], corner[up] = cell[across] - 1, cell[up] - 1
            loop = []
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                at = corner.copy()
                at[across], at[up] = at[across] + a, at[up] + b
                loop.append(point(tuple(int(i) for i in at)))
            faces.append(tuple(loop if change[tuple(cell)] > 0 else loop[::-1]))
    return points, faces


def area(part):
    """Of a part of quads, in square meters."""
    points, faces = part
    return sum((points[f[2]] - points[f[0]]).cross(points[f[3]] - points[f[1]]).length / 2 for f in faces)


def joined(parts):
    points, faces = [], []
    for more, of in parts:
        faces += [tuple(len(points) + i for i in face) for face in of]
        points += more
    return points, faces


def split(part, key):
    """{key(middle, normal): part} of the faces of one part; points that no face needs are left out."""
    points, groups = part[0], {}
    for face in part[1]:
        a, b, c = (points[i] for i in face[:3])
        middle = sum((points[i] for i in face), Vector()) / len(face)
        groups.setdefault(key(middle, (b - a).cross(c - b).normalized()), []).append(face)
    result = {}
    for name, faces in groups.items():
        used = sorted({i for face in faces for i in face})
        number = {old: new for new, old in enumerate(used)}
        result[name] = [points[i] for i in used], [tuple(number[i] for i in face) for face in faces]
    return result


# ---- objects ----------------------------------------------------------------------------------------------------------------


def add(name, parts, material, flat=True, matrix=None, gap=GAP):
    """An object of the parts, or of a dict {material: part}, with lightmap coordinates.

    Flat ones have a chart for each connected piece of a plane, curved ones are unwrapped by Blender's smart projection, `gap` apart.
    """
    by_material = parts if isinstance(parts, dict) else {material: joined(parts)}
    points, faces = joined(list(by_material.values()))
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(p) for p in points], [], faces)
    for made in by_material:
        mesh.materials.append(made)
    slots = [slot for slot, part in enumerate(by_material.values()) for _ in part[1]]
    mesh.polygons.foreach_set("material_index", slots)
    mesh.polygons.foreach_set("use_smooth", [not flat] * len(faces))
    thing = bpy.data.objects.new(name, mesh)
    if matrix is not None:
        thing.matrix_world = matrix
    bpy.context.scene.collection.objects.link(thing)
    unwrap_planes(mesh) if flat else unwrap_curved(thing, gap)
    return thing


def light(name, kind, place, power, color=(1, 1, 1), target=None, **settings):
    """A light of Blender's `kind`, in watts (a sun: irradiance); `target` is where it looks."""
    data = bpy.data.lights.new(name, kind)
    data.energy, data.color = power, color
    for key, value in settings.items():
        setattr(data, key, value)
    made = bpy.data.objects.new(name, data)
    made.location = place
    if target is not None:
        made.rotation_euler = (Vector(target) - Vector(place)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(made)
    return made


def glow(name, color, strength):
    """An emissive material: radiance `strength` times `color`."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # always there from Blender 5.0 on
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (*color, 1), strength
    tree.links.new(emission.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


# ---- the command ------------------------------------------------------------------------------------------------------------


def arguments_of(script, words, **options):
    """The .blend to write, as `out`, and a script's options with their defaults: a flag for each False, else a number."""
    parser = argparse.ArgumentParser(prog=f"python data/scenes/{script}.py")
    parser.add_argument("out", metavar="OUT.blend")
    for name, default in options.items():
        if default is False:
            parser.add_argument(f"--{name}", action="store_true")
        else:
            parser.add_argument(f"--{name}", type=type(default), default=default)
    found = parser.parse_args(words)
    if not found.out.endswith(".blend"):
        parser.error(f"expected a file that ends in .blend, found {found.out}")
    return found


def save(out, build):
    """Write what `build` fills an empty scene with; the exit status."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    build()
    bpy.ops.wm.save_as_mainfile(filepath=out, check_existing=False)
    return 0
