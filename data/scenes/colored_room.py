# SPDX-License-Identifier: GPL-3.0-or-later
"""Glossy things in a colored room: a stage with a red wall, a green wall and a pale floor, seen by one fixed camera.

What it shows is light that has met something before: red and green that bleed on the floor, on the pale wall and on a
matte block and ball, and their reflections in steel, copper and gold of several roughnesses, in glaze and in lacquer. The
stage has no roof and no front, its side walls fall towards the camera and all three are pierced, so that a sun from
anywhere above finds a way in: over the walls as a slanted edge, through them as arches and discs.

Nothing is smoother than POLISH, and metals not by far: what shines finds a sun of angle 0 only by the width of its own
highlight, and the narrower that is, the more it outshines all else. Metals cast no caustics, so that few samples are clean.

    python data/scenes/colored_room.py OUT.blend
"""

import sys
from math import atan2, cos, pi, radians, sin

import bpy
from mathutils import Matrix, Vector
from staging import add_camera, add_daylight, start_cycles, write

HALF, FRONT, BACK = 1.28, -1.06, 1.12  # m: the floor is |x| < HALF, FRONT < y < BACK
HIGH, LOW, THICK = 1.02, 0.48, 0.07  # m: the walls at the back, at the front, and their thickness
GAP = 0.34  # m between the back wall and the others
POLISH = 0.16  # the least roughness

# ---- shapes: a part is (points, faces) ---------------------------------------------------------------------------


def box(low, high):
    """The box between two corners."""
    ends = list(zip(low, high, strict=True))
    points = [Vector((x, y, z)) for z in ends[2] for y in ends[1] for x in ends[0]]
    return points, [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def moved(part, matrix):
    return [matrix @ p for p in part[0]], part[1]


def ring_faces(count, n):
    """Quads between `count` rings of n points each."""
    return [(i * n + j, i * n + (j + 1) % n, (i + 1) * n + (j + 1) % n, (i + 1) * n + j) for i in range(count - 1) for j in range(n)]


def skin(rings):
    """Quads between rings of equally many points; both ends are capped."""
    n, points = len(rings[0]), [p for ring in rings for p in ring]
    caps = [tuple(range(n - 1, -1, -1)), tuple(range(len(points) - n, len(points)))]
    return points, ring_faces(len(rings), n) + caps


def hoop(rings):
    """Quads between rings of which the last joins the first."""
    return [p for ring in [*rings, rings[0]] for p in ring], ring_faces(len(rings) + 1, len(rings[0]))


def circle(radius, z=0.0, segments=64):
    angles = (2 * pi * i / segments for i in range(segments))
    return [Vector((radius * cos(a), radius * sin(a), z)) for a in angles]


def smoothed(points, times=3):
    """A polyline with its corners cut, again and again (Chaikin): a lathe's curve from few points."""
    for _ in range(times):
        cut = [(a * t + b * (1 - t)) for a, b in zip(points, points[1:], strict=False) for t in (0.75, 0.25)]
        points = [points[0], *cut, points[-1]]
    return points


def curve(text, times=3):
    """A smooth outline of (radius, height) in meters from "radius height, ..." in centimeters."""
    return smoothed([Vector([float(n) / 100 for n in pair.split()]) for pair in text.split(",")], times)


def lathe(outline, segments=64):
    """An outline of (radius, z) turned about the z axis."""
    return skin([circle(r, z, segments) for r, z in outline])


def ball(radius, segments=64):
    """A sphere that stands on the floor."""
    angles = [pi * (i + 0.01) / (segments / 2 + 0.02) for i in range(segments // 2 + 1)]
    return lathe([(radius * sin(a), radius * (1 - cos(a))) for a in angles], segments)


def tube(path, radii, segments=24):
    """A tube along a path of points."""
    rings = []
    for i, (point, radius) in enumerate(zip(path, radii, strict=True)):
        turn = (path[min(i + 1, len(path) - 1)] - path[max(i - 1, 0)]).to_track_quat("Z", "Y")
        rings.append([point + turn @ p for p in circle(radius, 0, segments)])
    return skin(rings)


def pierced(outer, hole, thick):
    """A wall of a convex outline with one hole, both of (s, z) counter-clockwise; it stands on y in [0, thick].

    Rays from the middle of the hole through its points meet the outline; the ray nearest a corner goes to the corner.
    """
    middle = sum(hole, Vector((0, 0))) / len(hole)
    reach = []
    for p in hole:
        d = p - middle
        for a, b in zip(outer, [*outer[1:], outer[0]], strict=True):
            across = d.x * (b - a).y - d.y * (b - a).x
            if across > 1e-9:
                t = ((a - middle).x * (b - a).y - (a - middle).y * (b - a).x) / across
                s = ((a - middle).x * d.y - (a - middle).y * d.x) / across
                if t > 0 and -1e-6 <= s <= 1 + 1e-6:
                    reach.append(middle + d * t)
                    break
    for corner in outer:
        bearing = atan2(corner.y - middle.y, corner.x - middle.x)
        turns = [abs(sin((atan2(p.y - middle.y, p.x - middle.x) - bearing) / 2)) for p in hole]
        reach[turns.index(min(turns))] = corner
    loops = [(hole, 0.0), (reach, 0.0), (reach, thick), (hole, thick)]
    return hoop([[Vector((p.x, y, p.y)) for p in loop] for loop, y in loops])


def arch(s, low, high, width, segments=40):
    """A hole with a round top."""
    r = width / 2
    top = [Vector((s + r * cos(a), high - r + r * sin(a))) for a in (pi * i / segments for i in range(segments + 1))]
    left = [Vector((s - r, low + (high - r - low) * t)) for t in (0.75, 0.5, 0.25, 0)]
    floor = [Vector((s - r + width * t, low)) for t in (0.33, 0.67)]
    return [*top, *left, *floor, *(Vector((-p.x + 2 * s, p.y)) for p in reversed(left))]


def disc(s, z, radius, segments=64):
    return [Vector((s + p.x, z + p.y)) for p in circle(radius, 0, segments)]


def mesh_object(name, parts, material, smooth=False, location=(0, 0, 0), sharp=40):
    """One object of several parts. `smooth`: over all edges flatter than `sharp` degrees."""
    points, faces = [], []
    for part_points, part_faces in parts:
        base = len(points)
        points += [tuple(p) for p in part_points]
        faces += [tuple(base + i for i in face) for face in part_faces]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    if smooth:
        mesh.set_sharp_from_angle(angle=radians(sharp))
    mesh.materials.append(material)
    thing = bpy.data.objects.new(name, mesh)
    thing.location = location
    bpy.context.scene.collection.objects.link(thing)
    return thing


# ---- materials ---------------------------------------------------------------------------------------------------


def node(tree, kind, **inputs):
    """A node whose named inputs are values, or sockets to link."""
    made = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in inputs.items():
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, made.inputs[name])
        else:
            made.inputs[name].default_value = value
    return made


def new_material(name):
    """An empty material: (material, tree, the output's surface socket)."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # always there from Blender 5.0 on
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    return material, tree, tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"]


def matte(name, color):
    material, tree, surface = new_material(name)
    tree.links.new(node(tree, "BsdfDiffuse", Color=(*color, 1)).outputs[0], surface)
    return material


def glossy(name, color, roughness, metallic=0.0, **more):
    """A Principled surface; `more` are its further inputs."""
    material, tree, surface = new_material(name)
    looks = {"Base Color": (*color, 1), "Roughness": max(roughness, POLISH), "Metallic": metallic, **more}
    tree.links.new(node(tree, "BsdfPrincipled", **looks).outputs[0], surface)
    return material


def brushed(name, color, roughness):
    """Metal turned on a lathe: rings of lighter and darker strokes about z, and a highlight drawn out along the axis."""
    material, tree, surface = new_material(name)
    place = node(tree, "Mapping", Vector=node(tree, "TexCoord").outputs["Object"], Scale=(0.4, 0.4, 45))
    strokes = node(tree, "TexNoise", Vector=place.outputs[0], Scale=1.0, Detail=3.0).outputs[0]
    rough = node(tree, "MapRange", Value=strokes, **{"To Min": roughness - 0.06, "To Max": roughness + 0.06})
    tangent = tree.nodes.new("ShaderNodeTangent")
    tangent.direction_type, tangent.axis = "RADIAL", "Z"
    looks = {"Base Color": (*color, 1), "Metallic": 1.0, "Roughness": rough.outputs[0]}
    made = node(tree, "BsdfPrincipled", **looks, Anisotropic=0.6, Tangent=tangent.outputs[0])
    tree.links.new(made.outputs[0], surface)
    return material


def tiles(name, light, dark):
    """A pale floor of square tiles with thin joints, slightly glossy."""
    material, tree, surface = new_material(name)
    bricks = {"Color1": (*light, 1), "Color2": (*(0.94 * c for c in light), 1), "Mortar": (*dark, 1)}
    place = node(tree, "TexCoord").outputs["Object"]
    brick = node(tree, "TexBrick", Vector=place, Scale=1.0, **bricks, **{"Mortar Size": 0.004, "Brick Width": 0.3, "Row Height": 0.3})
    brick.offset = 0.0
    shader = node(tree, "BsdfPrincipled", **{"Base Color": brick.outputs[0], "Roughness": 0.38})
    tree.links.new(shader.outputs[0], surface)
    return material


# ---- the things --------------------------------------------------------------------------------------------------


def wall_top(s):
    """Height of a side wall, s from the back."""
    return HIGH + (LOW - HIGH) * s / (BACK - FRONT - GAP)


def add_side_wall(name, side, material, hole):
    """Three bays of falling height, each pierced by `hole(bay's middle, its width, its lowest top)`."""
    depth, bays = BACK - FRONT - GAP, 3
    parts = []
    for i in range(bays):
        a, b = depth * i / bays, depth * (i + 1) / bays
        outer = [Vector(p) for p in ((a, 0), (b, 0), (b, wall_top(b)), (a, wall_top(a)))]
        parts.append(pierced(outer, hole((a + b) / 2, b - a, wall_top((a + b) / 2)), THICK))
    turn = Matrix(((0, side, 0, side * HALF), (-1, 0, 0, BACK - GAP), (0, 0, 1, 0), (0, 0, 0, 1)))  # s runs to the front
    mesh_object(name, [moved(p, turn) for p in parts], material)


def add_stage():
    """Floor, three walls and the dark ground on which they stand."""
    mesh_object("Ground", [box((-60, -60, -0.2), (60, 60, -0.08))], matte("Slate", (0.30, 0.31, 0.33)))
    slab = box((-HALF - THICK, FRONT - 0.06, -0.08), (HALF + THICK, BACK + THICK, 0))
    mesh_object("Floor", [slab], tiles("Tiles", (0.74, 0.72, 0.68), (0.36, 0.34, 0.32)))
    add_side_wall("RedWall", -1, matte("Red", (0.72, 0.035, 0.03)), lambda s, w, top: arch(s, 0.16 * top, 0.84 * top, 0.3 * w))
    add_side_wall("GreenWall", 1, matte("Green", (0.05, 0.48, 0.08)), lambda s, w, top: disc(s, 0.6 * top, 0.2 * top))
    wide = HALF - GAP
    outer = [Vector(p) for p in ((-wide, 0), (wide, 0), (wide, HIGH), (-wide, HIGH))]
    back = moved(pierced(outer, disc(0.44, 0.62, 0.32), THICK), Matrix.Translation((0, BACK, 0)))
    mesh_object("BackWall", [back], matte("Plaster", (0.78, 0.76, 0.72)))


def add_vase():
    """A tall vase with a long neck, open at the top."""
    outline = curve("9 0.1, 9.5 0.1, 10 2, 15 12, 22 26, 20 42, 8 50, 4.6 60, 4.6 70, 8.4 79, 9 80, 7.6 79, 3.8 70, 3.6 58, 5 50", 4)
    glaze = glossy("CobaltGlaze", (0.018, 0.06, 0.36), 0.17)
    mesh_object("Vase", [lathe(outline, 96)], glaze, smooth=True, location=(0.2, 0.52, 0))


def add_teapot(location, turn):
    """Body, lid and knob turned, spout and handle bent."""
    body = lathe(curve("8 0, 9 0, 9 1.2, 17 4, 19.5 13, 15 21, 8.4 22.4, 8 22.4"), 80)
    lid = lathe(curve("8.6 22.5, 8.6 23.2, 6 25.5, 1.5 26.3, 1.2 27.2, 2.9 28.6, 2.6 30.8, 0.4 31.2", 3), 48)
    spout = smoothed([Vector(p) for p in ((0.13, 0, 0.07), (0.24, 0, 0.07), (0.26, 0, 0.17), (0.33, 0, 0.225))])
    radii = [0.05 + (0.021 - 0.05) * i / (len(spout) - 1) for i in range(len(spout))]
    handle = smoothed([Vector(p) for p in ((-0.14, 0, 0.19), (-0.26, 0, 0.24), (-0.33, 0, 0.12), (-0.25, 0, 0.03), (-0.15, 0, 0.06))])
    parts = [body, lid, tube(spout, radii), tube(handle, [0.02] * len(handle), 16)]
    lacquer = glossy("YellowLacquer", (0.82, 0.42, 0.03), 0.2)
    pot = mesh_object("Teapot", parts, lacquer, smooth=True, location=location, sharp=60)
    pot.rotation_euler.z = turn


def add_toy(x, y):
    """Lacquered rings on a stick, smaller and smaller, and a bead on top."""
    colors = ((0.55, 0.03, 0.25), (0.85, 0.22, 0.02), (0.80, 0.62, 0.03), (0.03, 0.33, 0.40), (0.12, 0.05, 0.32))
    z = 0.03
    mesh_object("ToyFoot", [lathe(curve("15 0.1, 16 0.1, 16 3, 15 3", 2))], glossy("Beech", (0.62, 0.42, 0.24), 0.35), True, (x, y, 0))
    for i, color in enumerate(colors):
        minor, major = 0.042 - 0.0035 * i, 0.092 - 0.014 * i
        angles = [2 * pi * j / 24 for j in range(24)]
        rings = [circle(major + minor * cos(a), minor * sin(a), 64) for a in angles]
        mesh_object(f"ToyRing{i}", [hoop(rings)], glossy(f"Lacquer{i}", color, 0.18), True, (x, y, z + minor - 0.001), 80)
        z += 2 * minor - 0.004
    mesh_object("ToyBead", [ball(0.042)], glossy("RedLacquer", (0.62, 0.02, 0.02), 0.18), True, (x, y, z - 0.004))


def add_things():
    mesh_object(
        "Drum",
        [lathe(curve("29 0.1, 30 0.1, 30 1.2, 30 39, 30 40, 29 40", 2), 96)],
        brushed("BrushedSteel", (0.62, 0.63, 0.65), 0.34),
        True,
    )
    bpy.data.objects["Drum"].location = (-0.66, 0.46, 0)
    add_teapot((-0.66, 0.46, 0.4), radians(-28))
    add_vase()
    block = mesh_object("Block", [box((-0.21, -0.21, 0.001), (0.21, 0.21, 0.42))], matte("Chalk", (0.80, 0.79, 0.76)))
    block.location, block.rotation_euler = (0.88, 0.36, 0), (0, 0, radians(24))
    gold = glossy("Gold", (0.92, 0.62, 0.20), 0.3, 1.0)
    mesh_object("GoldBall", [ball(0.16)], gold, True, (0.88, 0.36, 0.42))
    mesh_object("SteelBall", [ball(0.235)], glossy("Steel", (0.74, 0.75, 0.77), 0.24, 1.0), True, (0.1, -0.22, 0))
    mesh_object("CopperBall", [ball(0.15)], glossy("Copper", (0.86, 0.42, 0.26), 0.42, 1.0), True, (-0.36, -0.62, 0))
    mesh_object("ChalkBall", [ball(0.16)], matte("ChalkToo", (0.80, 0.79, 0.76)), True, (-0.86, -0.30, 0))
    add_toy(0.72, -0.46)


# ---- the scene ---------------------------------------------------------------------------------------------------


def set_cycles(scene):
    """Four bounces, none of them left to Russian roulette, no caustics, no clamp."""
    cycles = start_cycles(scene)
    cycles.min_light_bounces = 4
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces, cycles.transmission_bounces = 4, 3, 2, 0


def build():
    """Fill the current, empty scene."""
    add_stage()
    add_things()
    add_camera((0.18, -4.8, 2.42), (0.0, 0.02, 0.34), 55)
    add_daylight((-0.45, -0.55, 0.70), 3.0, (0.40, 0.45, 0.52), 0.4, color=(1.0, 0.95, 0.88))
    set_cycles(bpy.context.scene)


if __name__ == "__main__":
    sys.exit(write("colored_room", build, sys.argv[1:]))
