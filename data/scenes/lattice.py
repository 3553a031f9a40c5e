# SPDX-License-Identifier: GPL-3.0-or-later
"""A terrace under a pergola with a vine on it, seen by one fixed camera: shadows of slats and leaves on stone.

What it shows is where relighting maps end: thousands of leaves, a trellis and a roof of slats throw shadows that are hard
and finer than the light spacing, over a floor, a bench and a wall with other shadows under every sun. Leaves pass a part of
their light. Maps blur such shadows and a bake by --sun-angle auto softens them; a transport without the direct light is
smooth.

The object `Floor` is one quad at z = 0 (UV layer "lightmap" = [0, 1]², u along +x, v along +y), also a lightmap's receiver.

    python data/scenes/lattice.py OUT.blend
"""

import random
import sys
from math import cos, pi, sin

import bpy
from mathutils import Matrix, Vector
from staging import add_camera, add_daylight, start_cycles, write

HALF = 2.5  # m: the floor is |x|, |y| < HALF, the wall stands at its back
LEFT, RIGHT, NEAR, FAR, ROOF = -2.15, 0.85, -0.55, 2.25, 2.3  # m: the pergola's posts, and its beams' height
UP = Vector((0, 0, 1))

# ---- shapes: a part is (points, faces) ---------------------------------------------------------------------------


def box(low, high):
    """The box between two corners."""
    ends = list(zip(low, high, strict=True))
    points = [Vector((x, y, z)) for z in ends[2] for y in ends[1] for x in ends[0]]
    return points, [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def moved(part, matrix):
    return [matrix @ p for p in part[0]], part[1]


def beam(start, end, width, height):
    """A box along the line from start to end."""
    start, end = Vector(start), Vector(end)
    turn = (end - start).to_track_quat("Y", "Z").to_matrix().to_4x4()
    plain = box((-width / 2, 0, -height / 2), (width / 2, (end - start).length, height / 2))
    return moved(plain, Matrix.Translation(start) @ turn)


def skin(rings):
    """Quads between rings of equally many points; both ends are capped."""
    n, points = len(rings[0]), [p for ring in rings for p in ring]
    faces = [(i * n + j, i * n + (j + 1) % n, (i + 1) * n + (j + 1) % n, (i + 1) * n + j) for i in range(len(rings) - 1) for j in range(n)]
    return points, [*faces, tuple(range(n - 1, -1, -1)), tuple(range(len(points) - n, len(points)))]


def circle(radius, z=0.0, segments=32):
    angles = (2 * pi * i / segments for i in range(segments))
    return [Vector((radius * cos(a), radius * sin(a), z)) for a in angles]


def lathe(text, segments=32):
    """A profile "radius height, ..." in centimeters turned about the z axis."""
    return skin([circle(*(float(n) / 100 for n in pair.split()), segments) for pair in text.split(",")])


def tube(path, start, end, segments=5):
    """A stem along a path of points, its radius from `start` to `end`."""
    rings = []
    for i, point in enumerate(path):
        turn = (path[min(i + 1, len(path) - 1)] - path[max(i - 1, 0)]).to_track_quat("Z", "Y")
        rings.append([point + turn @ p for p in circle(start + (end - start) * i / len(path), 0, segments)])
    return skin(rings)


def mesh_object(name, parts, material, smooth=False):
    points, faces = [], []
    for part_points, part_faces in parts:
        base = len(points)
        points += [tuple(p) for p in part_points]
        faces += [tuple(base + i for i in face) for face in part_faces]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    mesh.materials.append(material)
    thing = bpy.data.objects.new(name, mesh)
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


def surface(name, color, passes=0.0):
    """A diffuse material that lets the part `passes` of its light through. `color`: RGB, or a function from tree to color socket."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # always there from Blender 5.0 on
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    base = color(tree) if callable(color) else (*color, 1)
    shader = node(tree, "BsdfDiffuse", Color=base)
    if passes:
        behind = node(tree, "BsdfTranslucent", Color=base)
        front, shader = shader, node(tree, "MixShader", Fac=passes)
        tree.links.new(front.outputs[0], shader.inputs[1])
        tree.links.new(behind.outputs[0], shader.inputs[2])
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def ramp(tree, value, *stops):
    """Colors at positions along a value in [0, 1]."""
    made = node(tree, "ValToRGB", Fac=value)
    for i, (position, color) in enumerate(stops):
        stop = made.color_ramp.elements[i] if i < 2 else made.color_ramp.elements.new(position)
        stop.position, stop.color = position, (*color, 1)
    return made.outputs[0]


def noise(tree, scale, detail=3.0, stretch=(1, 1, 1)):
    place = node(tree, "Mapping", Vector=node(tree, "TexCoord").outputs["Object"], Scale=stretch)
    return node(tree, "TexNoise", Vector=place.outputs[0], Scale=scale, Detail=detail).outputs[0]


def mottled(dark, light, scale, stretch=(1, 1, 1)):
    """Noise between two colors."""
    return lambda tree: ramp(tree, noise(tree, scale, 3.0, stretch), (0.32, dark), (0.68, light))


def each(*stops):
    """A color for each separate piece of a mesh."""
    return lambda tree: ramp(tree, node(tree, "NewGeometry").outputs["Random Per Island"], *stops)


def paving(tree):
    """Slabs of pale stone in a bond, all different, with darker joints."""
    place = node(tree, "TexCoord").outputs["Object"]
    slabs = {"Color1": (0.74, 0.67, 0.57, 1), "Color2": (0.60, 0.53, 0.45, 1), "Mortar": (0.30, 0.26, 0.22, 1)}
    sizes = {"Mortar Size": 0.007, "Mortar Smooth": 0.3, "Brick Width": 0.62, "Row Height": 0.42}
    brick = node(tree, "TexBrick", Vector=place, Scale=1.0, **slabs, **sizes).outputs[0]
    stain = ramp(tree, noise(tree, 2.3, 5.0), (0.3, (0.84, 0.84, 0.86)), (0.7, (1.08, 1.07, 1.04)))
    mixed = node(tree, "VectorMath")
    mixed.operation = "MULTIPLY"
    tree.links.new(brick, mixed.inputs[0])
    tree.links.new(stain, mixed.inputs[1])
    return mixed.outputs[0]


# ---- what is built -----------------------------------------------------------------------------------------------


def add_floor():
    """The receiver: one quad."""
    mesh = bpy.data.meshes.new("Floor")
    mesh.from_pydata([(-HALF, -HALF, 0), (HALF, -HALF, 0), (HALF, HALF, 0), (-HALF, HALF, 0)], [], [(0, 1, 2, 3)])
    mesh.uv_layers.new(name="lightmap").data.foreach_set("uv", [0, 0, 1, 0, 1, 1, 0, 1])
    mesh.materials.append(surface("Paving", paving))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Floor", mesh))


def hill(x, y):
    """Height of the ground: flat about the terrace, rising a little behind its wall, less than low suns do."""
    return max(0.0, y - 4) * 0.045 + 0.5 * sin(x * 0.15 + 1.0) * min(1.0, max(0.0, y - 6) / 12) - 0.14


def add_surroundings(rng):
    """A step around the floor, grass, a slope behind the wall with olive trees and cypresses on it."""
    stone = surface("Kerb", mottled((0.36, 0.32, 0.28), (0.52, 0.47, 0.41), 6))
    w, h = 0.22, HALF + 0.002
    rims = [box((-h - w, -h - w, -0.14), (h + w, -h, 0.0)), box((-h - w, -h, -0.14), (-h, h, 0.0)), box((h, -h, -0.14), (h + w, h, 0.0))]
    mesh_object("Kerb", rims, stone)
    rows, columns, points = 30, 40, []
    for j in range(rows + 1):
        y = -14 + 160 * (j / rows) ** 1.5
        points += [Vector((x, y, hill(x, y))) for x in (-100 + 200 * i / columns for i in range(columns + 1))]
    n = columns + 1
    faces = [(j * n + i, j * n + i + 1, (j + 1) * n + i + 1, (j + 1) * n + i) for j in range(rows) for i in range(columns)]
    mesh_object("Meadow", [(points, faces)], surface("Meadow", mottled((0.20, 0.21, 0.07), (0.40, 0.35, 0.16), 0.9)), smooth=True)
    cypresses, olives = [], []
    for i in range(90):
        x, y = rng.uniform(-32, 10), rng.uniform(14, 42)
        if i % 5 == 0:
            size, outline = rng.uniform(2.0, 3.4), ((0.05, 0.0), (0.16, 0.08), (0.19, 0.3), (0.14, 0.7), (0.07, 0.9), (0.01, 1.0))
        else:
            size, outline = rng.uniform(0.45, 0.9), ((0.1, 0.2), (0.6, 0.3), (0.85, 0.6), (0.8, 0.9), (0.5, 1.2), (0.1, 1.3))
        crown = [[p * size * rng.uniform(0.75, 1.2) + UP * h * size for p in circle(r, 0, 14)] for r, h in outline]
        (cypresses if i % 5 == 0 else olives).append(moved(skin(crown), Matrix.Translation((x, y, hill(x, y)))))
    mesh_object("Cypresses", cypresses, surface("Cypresses", each((0.0, (0.025, 0.045, 0.02)), (1.0, (0.045, 0.075, 0.03)))), smooth=True)
    mesh_object("Olives", olives, surface("Olives", each((0.0, (0.075, 0.11, 0.045)), (1.0, (0.15, 0.18, 0.09)))), smooth=True)


def add_wall():
    """Limewashed, with a row of clay tiles on top."""
    wash = surface("Limewash", mottled((0.70, 0.57, 0.41), (0.82, 0.72, 0.56), 1.7))
    mesh_object("Wall", [box((-6.0, HALF, -0.2), (4.2, HALF + 0.25, 1.72))], wash)
    tiles, x = [], -6.1
    while x < 4.2:
        ridge = [Vector((0.085 * cos(a), 0, 0.06 * sin(a))) for a in (pi * i / 8 for i in range(9))]
        rings = [[p + Vector((x, y, 1.715)) for p in ridge] for y in (HALF - 0.09, HALF + 0.34)]
        tiles.append(skin(rings))
        x += 0.155
    mesh_object("Tiles", tiles, surface("ClayTiles", each((0.0, (0.30, 0.105, 0.055)), (1.0, (0.50, 0.22, 0.12)))), smooth=True)


def add_pergola(wood, pale):
    """Four posts, two beams and knee braces, a roof of slats; between the left posts a trellis."""
    frame = [box((x - 0.06, y - 0.06, 0), (x + 0.06, y + 0.06, ROOF)) for x in (LEFT, RIGHT) for y in (NEAR, FAR)]
    frame += [box((LEFT - 0.35, y - 0.045, ROOF), (RIGHT + 0.35, y + 0.045, ROOF + 0.15)) for y in (NEAR, FAR - 0.02)]
    for x, s in ((LEFT, 1), (RIGHT, -1)):
        frame += [beam((x + s * 0.03, y, ROOF - 0.45), (x + s * 0.46, y, ROOF + 0.02), 0.06, 0.07) for y in (NEAR, FAR)]
    mesh_object("Pergola", frame, wood)
    count = 12
    middles = [LEFT - 0.2 + (RIGHT - LEFT + 0.4) * i / (count - 1) for i in range(count)]
    mesh_object("Slats", [box((x - 0.025, NEAR - 0.4, ROOF + 0.15), (x + 0.025, HALF - 0.1, ROOF + 0.24)) for x in middles], wood)
    laths, y0, y1, z0, z1 = [], NEAR + 0.06, FAR - 0.06, 0.16, 2.0
    for lean in (1, -1):
        for i in range(-14, 30):
            c = y0 + i * 0.19  # the line y = c + lean * (z - z0), cut to the frame
            ends = sorted(z0 + (y - c) * lean for y in (y0, y1))
            low, high = max(z0, ends[0]), min(z1, ends[1])
            if high - low > 0.06:
                start, end = ((LEFT + lean * 0.007, c + lean * (z - z0), z) for z in (low, high))
                laths.append(beam(start, end, 0.012, 0.034))
    laths += [box((LEFT - 0.03, y0, z - 0.03), (LEFT + 0.03, y1, z + 0.03)) for z in (z0, z1)]
    mesh_object("Trellis", laths, pale)


def add_bench(paint):
    """Slats on two frames, before the wall."""
    x0, x1, y, parts = -1.55, 0.05, 1.62, []
    for x in (x0 + 0.1, x1 - 0.1):
        parts += [box((x - 0.035, y - 0.02, 0), (x + 0.035, y + 0.05, 0.62)), beam((x, y + 0.44, 0), (x, y + 0.54, 0.92), 0.07, 0.06)]
        parts += [box((x - 0.03, y, 0.34), (x + 0.03, y + 0.48, 0.40)), box((x - 0.045, y - 0.05, 0.62), (x + 0.045, y + 0.52, 0.655))]
    parts += [box((x0, y + 0.01 + 0.105 * i, 0.40), (x1, y + 0.095 + 0.105 * i, 0.43)) for i in range(4)]
    parts += [
        beam((x0, y + 0.455 + 0.022 * i, 0.52 + 0.115 * i), (x1, y + 0.455 + 0.022 * i, 0.52 + 0.115 * i), 0.026, 0.085) for i in range(4)
    ]
    mesh_object("Bench", parts, paint)


POT = "16 0, 17 0, 19 4, 23 20, 26.5 34, 26.5 36, 29 36.5, 29.5 43, 28 43.5, 26 43.5, 25.5 39, 0.5 38.5"


# ---- what grows --------------------------------------------------------------------------------------------------


def leaf(rng, at, facing, size):
    """Two planes folded at the rib, heart-shaped, hung from `at`; it faces and droops at random about `facing`."""
    half = ((0.40, 0.02), (0.52, 0.36), (0.26, 0.78))
    fold, droop = rng.uniform(0.1, 0.35), rng.uniform(0.0, 0.25)
    points = [Vector((0, 0, 0)), Vector((0, 1.08, -droop))]
    for side in (1, -1):
        points += [Vector((side * x, y, fold * x - droop * y * y)) for x, y in half]
    normal = (Vector(facing) + Vector([rng.gauss(0, 0.45) for _ in range(3)])).normalized()
    turn = normal.to_track_quat("Z", "Y").to_matrix() @ Matrix.Rotation(rng.uniform(0, 2 * pi), 3, "Z")
    return [at + turn @ p * size for p in points], [(0, 2, 3, 4, 1), (0, 1, 7, 6, 5)]


class Vine:
    """Stems, leaves and flowers as they grow, each a list of parts."""

    def __init__(self, rng):
        self.rng, self.stems, self.leaves, self.flowers = rng, [], [], []

    def wander(self, path, amount, steps=9):
        """The path in small steps, each put off it at random but smoothly."""
        fine, off = [], Vector((0, 0, 0))
        for a, b in zip(path, path[1:], strict=False):
            for i in range(steps):
                off = off * 0.8 + Vector([self.rng.gauss(0, amount) for _ in range(3)])
                fine.append(Vector(a).lerp(Vector(b), i / steps) + off)
        return fine

    def grow(self, path, density, facing=(0, 0, 1), spread=0.1, thick=0.012, blooms=0.0):
        """A stem along `path` with `density` leaves a meter within `spread`; in places, flowers among them."""
        self.stems.append(tube(path, thick, thick * 0.4))
        length = sum((b - a).length for a, b in zip(path, path[1:], strict=False))
        for _ in range(int(density * length)):
            at = path[self.rng.randrange(len(path))] + Vector([self.rng.gauss(0, spread) for _ in range(3)])
            at.z = max(at.z, 0.03)
            self.leaves.append(leaf(self.rng, at, facing, self.rng.uniform(0.06, 0.115)))
        for _ in range(int(blooms * length)):
            middle = path[self.rng.randrange(len(path))] + Vector([self.rng.gauss(0, spread) for _ in range(3)])
            for _ in range(14):
                at = middle + Vector([self.rng.gauss(0, 0.045) for _ in range(3)])
                self.flowers.append(leaf(self.rng, at, (0.2, -0.5, 0.8), self.rng.uniform(0.03, 0.05)))

    def bush(self, at, radius, count):
        """Leaves about stems that fan out from a pot."""
        for i in range(9):
            a, lean = 2 * pi * i / 9 + self.rng.uniform(-0.3, 0.3), self.rng.uniform(0.2, 1.0)
            tip = at + Vector((cos(a) * lean, sin(a) * lean, 1.7 - 0.6 * lean)) * radius
            self.grow(self.wander([at, at.lerp(tip, 0.5) + UP * 0.1, tip], 0.006), count, (0, 0, 1), 0.07, 0.008, 1.2)


def add_vine(rng):
    """From the feet of the posts and the trellis over the roof, thick at the back and on the left, thin towards the camera."""
    vine, top = Vine(rng), ROOF + 0.27
    for x, y, density in ((LEFT, NEAR, 55), (LEFT, FAR, 60), (RIGHT, FAR, 45), (RIGHT, NEAR, 22)):
        turns = [(x + 0.09 * cos(2.2 * k), y + 0.09 * sin(2.2 * k), ROOF * k / 7) for k in range(8)]
        vine.grow(vine.wander(turns, 0.005), density, ((x + 0.65) * 0.5, -0.6, 0.6), 0.075, 0.017)
    for y in [NEAR + 0.15 + 2.7 * (i / 8) ** 0.8 for i in range(9)]:  # along the roof, from the left
        reach = rng.uniform(0.35, 1.0) if y < 1.2 else rng.uniform(0.75, 1.05)
        path = [
            (LEFT - 0.2, y, top),
            (LEFT + 1.2, y + rng.uniform(-0.2, 0.2), top),
            (LEFT - 0.2 + 3.5 * reach, y + rng.uniform(-0.4, 0.3), top),
        ]
        vine.grow(vine.wander(path, 0.012), rng.uniform(30, 75), (0, 0, 1), 0.10, 0.013, 1.6)
    for x in (-2.35, -1.75, -1.4, -0.8, -0.2, 0.4, 1.0):  # over the front beam, and down
        length = rng.uniform(0.25, 0.75)
        path = [(x, NEAR + 0.2, top), (x + 0.05, NEAR - 0.08, ROOF + 0.12), (x + rng.uniform(-0.1, 0.1), NEAR - 0.1, ROOF + 0.1 - length)]
        vine.grow(vine.wander(path, 0.008), 48, (0, -0.8, 0.5), 0.06, 0.008, 3.5)
    for y in (-0.2, 0.35, 0.9, 1.7):  # up the trellis
        path = [(LEFT, y, 0.05), (LEFT, y + rng.uniform(-0.3, 0.3), 1.0), (LEFT, y + rng.uniform(-0.5, 0.5), rng.uniform(1.5, 2.1))]
        vine.grow(vine.wander(path, 0.012), 48, (0.6, -0.3, 0.5), 0.07, 0.011, 1.2)
    path = [(4.1, HALF - 0.05, 1.78), (3.2, HALF - 0.06, 1.80), (2.1, HALF - 0.06, 1.76), (1.9, HALF - 0.06, 1.1)]
    vine.grow(vine.wander(path, 0.01), 70, (0, -0.7, 0.6), 0.085, 0.012, 5.0)  # over the wall
    return vine


def add_pots(vine):
    """Three clay pots with bushes."""
    pots, soil = [], []
    for x, y, size, count in ((1.62, 1.72, 1.05, 52), (2.12, 1.05, 0.72, 42), (1.28, -0.15, 0.62, 40)):
        place = Matrix.Translation((x, y, 0.002)) @ Matrix.Scale(size, 4)
        pots.append(moved(lathe(POT, 40), place))
        soil.append(moved(lathe("25 38, 25 39.6, 1 40.5", 24), place))
        vine.bush(place @ Vector((0, 0, 0.39)), 0.42 * size, count)
    mesh_object("Pots", pots, surface("Clay", mottled((0.40, 0.15, 0.08), (0.55, 0.25, 0.14), 5)), smooth=True).data.set_sharp_from_angle(
        angle=0.6
    )
    mesh_object("Soil", soil, surface("Soil", (0.05, 0.035, 0.025)))


# ---- the scene ---------------------------------------------------------------------------------------------------


def set_cycles(scene):
    """Three bounces, none of them left to Russian roulette, no clamp; nothing is glossy."""
    cycles = start_cycles(scene)
    cycles.min_light_bounces = 3
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces, cycles.transmission_bounces = 3, 3, 0, 2


def build(seed=5):
    """Fill the current, empty scene."""
    rng = random.Random(seed)
    add_floor()
    add_surroundings(rng)
    add_wall()
    wood = surface("Larch", mottled((0.24, 0.13, 0.07), (0.42, 0.26, 0.15), 9, (1, 1, 0.3)))
    add_pergola(wood, surface("Whitewood", mottled((0.60, 0.57, 0.50), (0.74, 0.71, 0.64), 9)))
    add_bench(surface("BluePaint", mottled((0.06, 0.20, 0.32), (0.10, 0.28, 0.40), 6)))
    vine = add_vine(rng)
    add_pots(vine)
    mesh_object("Stems", vine.stems, surface("Stems", (0.16, 0.11, 0.07)), smooth=True)
    greens = each((0.0, (0.055, 0.16, 0.025)), (1.0, (0.30, 0.36, 0.07)), (0.45, (0.10, 0.24, 0.035)), (0.85, (0.19, 0.33, 0.06)))
    mesh_object("Leaves", vine.leaves, surface("Leaves", greens, passes=0.35))
    pinks = each((0.0, (0.48, 0.03, 0.20)), (1.0, (0.75, 0.10, 0.36)))
    mesh_object("Flowers", vine.flowers, surface("Flowers", pinks, passes=0.35))
    add_camera((2.75, -5.4, 3.25), (-0.38, 0.7, 0.80), 40.5)
    add_daylight((-0.55, -0.35, 0.75), 3.5, (0.35, 0.45, 0.60), 0.6)
    set_cycles(bpy.context.scene)


if __name__ == "__main__":
    sys.exit(write("lattice", build, sys.argv[1:]))
