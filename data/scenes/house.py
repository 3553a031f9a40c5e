# SPDX-License-Identifier: GPL-3.0-or-later
"""A forsaken room under a broken roof, seen by one fixed camera: the background of a horror game.

After the scene "house" of [Wong2005, fig. 7]. The wall on the camera's side is missing, half of the roof boards are
gone and two walls have windows, so that a sun from anywhere above comes in through something that draws its shadow.

    python data/scenes/house.py OUT.blend
"""

import random
import sys
from itertools import pairwise
from math import atan2, cos, hypot, pi, radians, sin

import bpy
from mathutils import Euler, Matrix, Vector
from staging import add_camera, add_daylight, start_cycles, write

HALF, FRONT, BACK, EAVES, RIDGE = 2.5, -2.6, 3.0, 2.9, 4.5  # m: the room is |x| < HALF, FRONT < y < BACK

# ---- shapes: a part is (points, faces) ---------------------------------------------------------------------------

BOX_FACES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def box(low, high):
    """The box between two corners."""
    ends = list(zip(low, high, strict=True))
    return [Vector((x, y, z)) for z in ends[2] for y in ends[1] for x in ends[0]], BOX_FACES


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


def circle(radius, z, segments):
    angles = (2 * pi * i / segments for i in range(segments))
    return [Vector((radius * cos(a), radius * sin(a), z)) for a in angles]


def profile(text):
    """Points (radius, height) in meters from "radius height, ..." in centimeters."""
    return [tuple(float(n) / 100 for n in pair.split()) for pair in text.split(",")]


def lathe(outline, segments=16):
    """An outline of (radius, z) turned about the z axis."""
    return skin([circle(r, z, segments) for r, z in outline])


def tube(path, radii, segments=6):
    rings = []
    for i, (point, radius) in enumerate(zip(path, radii, strict=True)):
        turn = (path[min(i + 1, len(path) - 1)] - path[max(i - 1, 0)]).to_track_quat("Z", "Y")
        rings.append([point + turn @ p for p in circle(radius, 0, segments)])
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


def surface(name, color, roughness, metallic=0.0):
    """A Principled surface, diffuse from roughness 0.7 on. `color`: RGB, or a function from tree to color socket."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # always there from Blender 5.0 on
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    base = color(tree) if callable(color) else (*color, 1)
    if roughness >= 0.7:
        shader = node(tree, "BsdfDiffuse", Color=base)
    else:
        shader = node(tree, "BsdfPrincipled", **{"Base Color": base, "Roughness": roughness, "Metallic": metallic})
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def ramp(tree, value, *stops):
    """Colors at positions along a value in [0, 1]."""
    made = node(tree, "ValToRGB", Fac=value)
    for i, (position, color) in enumerate(stops):
        stop = made.color_ramp.elements[i] if i < 2 else made.color_ramp.elements.new(position)
        stop.position, stop.color = position, (*color, 1)
    return made.outputs[0]


def noise(tree, scale, detail=4.0, stretch=(1, 1, 1)):
    place = node(tree, "Mapping", Vector=node(tree, "TexCoord").outputs["Object"], Scale=stretch)
    return node(tree, "TexNoise", Vector=place.outputs[0], Scale=scale, Detail=detail).outputs[0]


def calculate(tree, operation, a, b):
    made = tree.nodes.new("ShaderNodeMath")
    made.operation = operation
    for socket, value in zip(made.inputs, (a, b), strict=False):
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return made.outputs[0]


def wood(dark, light, stretch=(8, 0.8, 8)):
    """Grain along y unless stretched otherwise; every separate piece has its own shade."""

    def color(tree):
        piece = tree.nodes.new("ShaderNodeNewGeometry").outputs["Random Per Island"]
        shade = calculate(tree, "MULTIPLY_ADD", piece, 0.45)
        tree.links.new(noise(tree, 2.5, stretch=stretch), shade.node.inputs[2])
        return ramp(tree, shade, (0.35, dark), (1.0, light))

    return color


def wallpaper(tree):
    """Faded stripes, stained by damp from above and below."""
    x, y, z = node(tree, "SeparateXYZ", Vector=node(tree, "TexCoord").outputs["Object"]).outputs
    stripe = calculate(tree, "SINE", calculate(tree, "MULTIPLY", calculate(tree, "ADD", x, y), 26.0), 0)
    paper = ramp(tree, calculate(tree, "MULTIPLY_ADD", stripe, 0.5), (0.0, (0.56, 0.60, 0.48)), (0.6, (0.78, 0.76, 0.62)))
    height = calculate(tree, "MULTIPLY", calculate(tree, "ABSOLUTE", calculate(tree, "SUBTRACT", z, 1.75), 0), 0.22)
    damp = ramp(tree, calculate(tree, "ADD", noise(tree, 1.6, 6.0), height), (0.55, (1, 1, 1)), (0.85, (0.38, 0.31, 0.23)))
    mix = tree.nodes.new("ShaderNodeVectorMath")
    mix.operation = "MULTIPLY"
    tree.links.new(paper, mix.inputs[0])
    tree.links.new(damp, mix.inputs[1])
    return mix.outputs[0]


def rug(tree):
    """Wine red with an ochre border, by the distance from the object's origin."""
    x, y, _ = node(tree, "SeparateXYZ", Vector=node(tree, "TexCoord").outputs["Object"]).outputs
    squares = calculate(tree, "ADD", calculate(tree, "MULTIPLY", x, x), calculate(tree, "MULTIPLY", y, y))
    radius = calculate(tree, "ADD", calculate(tree, "SQRT", squares, 0), calculate(tree, "MULTIPLY", noise(tree, 14.0), 0.06))
    wine, deep, ochre = (0.30, 0.055, 0.045), (0.17, 0.03, 0.035), (0.46, 0.32, 0.15)
    inner = ((0.30, wine), (0.31, ochre), (0.34, ochre), (0.35, deep))
    outer = ((0.80, wine), (0.81, ochre), (0.87, ochre), (0.88, deep))
    return ramp(tree, radius, (0.0, wine), (1.0, deep), *inner, *outer)


# ---- the shell ---------------------------------------------------------------------------------------------------


def pierced_wall(length, height, thickness, openings):
    """Boxes of a wall along +x from the origin, its face at y = 0, around openings (x0, x1, z0, z1) sorted by x."""
    parts, x = [], 0.0
    for x0, x1, z0, z1 in openings:
        parts += [box((x, 0, 0), (x0, thickness, height)), box((x0, 0, z1), (x1, thickness, height))]
        parts += [box((x0, 0, 0), (x1, thickness, z0))] if z0 > 0 else []
        x = x1
    return [*parts, box((x, 0, 0), (length, thickness, height))]


def window(x0, x1, z0, z1, columns, rows):
    """Frame and muntins in an opening of a wall along +x."""
    bars = [((x0 + (x1 - x0) * i / columns), 0.05 if i in (0, columns) else 0.022) for i in range(columns + 1)]
    parts = [box((x - w, 0.06, z0), (x + w, 0.13, z1)) for x, w in bars]
    rails = [((z0 + (z1 - z0) * i / rows), 0.05 if i in (0, rows) else 0.022) for i in range(rows + 1)]
    parts += [box((x0, 0.065, z - w), (x1, 0.125, z + w)) for z, w in rails]
    return [*parts, box((x0 - 0.1, -0.1, z0 - 0.08), (x1 + 0.1, 0.1, z0 - 0.03))]


def wainscot(x0, x1, height=0.92, step=0.165):
    """Dark boards, a skirting and a rail before a wall along +x."""
    count = max(1, round((x1 - x0) / step))
    edges = [x0 + (x1 - x0) * i / count for i in range(count + 1)]
    boards = [box((a + 0.006, -0.02, 0), (b - 0.006, 0, height)) for a, b in pairwise(edges)]
    return [*boards, box((x0, -0.045, 0), (x1, 0, 0.13)), box((x0, -0.055, height), (x1, 0, height + 0.05))]


def add_walls(paper, dark):
    """Left wall with a wide window, back wall with a narrower one, right wall closed behind the stairs."""
    back = Matrix.Translation((-HALF, BACK, 0))
    left = Matrix.Translation((-HALF, FRONT, 0)) @ Matrix.Rotation(pi / 2, 4, "Z")
    right = Matrix.Translation((HALF, BACK, 0)) @ Matrix.Rotation(-pi / 2, 4, "Z")
    depth, width = BACK - FRONT, 2 * HALF
    wide, narrow = (2.0, 4.2, 0.98, 2.55), (1.85, 3.2, 0.8, 2.62)
    walls = [moved(p, left) for p in pierced_wall(depth, EAVES, 0.18, [wide])]
    walls += [moved(p, back) for p in pierced_wall(width, EAVES, 0.18, [narrow])]
    walls += [moved(p, right) for p in pierced_wall(depth, EAVES, 0.18, [])]
    mesh_object("Walls", walls, paper)
    trim = [moved(p, left) for p in (*window(*wide, 4, 3), *wainscot(0, depth))]
    trim += [moved(p, back) for p in (*window(*narrow, 3, 4), *wainscot(0, narrow[0]), *wainscot(narrow[1], width))]
    trim += [moved(p, right) for p in wainscot(0, depth)]
    mesh_object("Panelling", trim, dark)


def add_floor(rng, planks):
    parts, x = [], -HALF
    while x < HALF - 0.01:
        y = FRONT - 1.4 - rng.random()
        while y < BACK:
            length = 1.5 + 1.5 * rng.random()
            parts.append(box((x + 0.004, y + 0.003, -0.04), (x + 0.153, min(y + length, BACK), 0.003 * rng.random())))
            y += length
        x += 0.1563
    mesh_object("Floor", parts, planks)
    below = box((-HALF, FRONT - 2.4, -0.2), (HALF, BACK, -0.041))
    mesh_object("Underfloor", [below], surface("Soot", (0.02, 0.02, 0.02), 0.9))


def add_roof(rng, timber, boards):
    """Tie beams, rafters, a ridge, a gable of boards, and what is left of the roof."""
    slope, parts, rest = hypot(HALF, RIDGE - EAVES), [], []
    for y in (-1.9, -0.95, 0.0, 0.95, 1.9, 2.9):
        parts += [] if y in (-1.9, 0.0, 1.9) else [beam((-HALF, y, EAVES - 0.02), (HALF, y, EAVES - 0.02), 0.13, 0.17)]
        parts += [beam((s * HALF, y, EAVES), (0, y, RIDGE), 0.09, 0.13) for s in (-1, 1)]
    parts.append(beam((0, FRONT, RIDGE), (0, BACK, RIDGE), 0.1, 0.16))
    for side in (-1, 1):
        for i in range(15):
            if rng.random() < (0.5 if side > 0 else 0.35):
                t = (i + 0.5) / 15
                y0, y1 = FRONT + 2.0 * rng.random() ** 2, BACK - 2.5 * rng.random() ** 3
                tilt = Matrix.Rotation(side * atan2(RIDGE - EAVES, HALF), 4, "Y")
                place = Matrix.Translation((side * HALF * (1 - t), 0, EAVES + (RIDGE - EAVES) * t + 0.08))
                rest.append(moved(box((-slope / 32, y0, 0), (slope / 32, y1, 0.02)), place @ tilt))
    for i in range(24):
        x = -HALF + (i + 0.5) * 2 * HALF / 24
        top = EAVES + (RIDGE - EAVES) * (1 - abs(x) / HALF)
        rest += [] if rng.random() < 0.3 else [box((x - 0.095, BACK, EAVES), (x + 0.095, BACK + 0.03, top))]
    mesh_object("Rafters", parts, timber)
    mesh_object("RoofBoards", rest, boards)


def add_tree(rng, bark):
    """A dead tree before the back window."""
    parts = []

    def grow(start, direction, length, radius, depth):
        path = [start]
        for _ in range(3):
            wander = Vector((rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-0.6, 1))) * 0.28
            direction = (direction + wander).normalized()
            path.append(path[-1] + direction * length / 3)
        parts.append(tube(path, [radius, radius * 0.85, radius * 0.7, radius * 0.55], 6 if depth < 2 else 4))
        for _ in range(3 if depth < 4 else 0):
            turn = Euler([rng.uniform(-0.9, 0.9) for _ in range(3)]).to_matrix()
            grow(path[-1 - rng.randrange(2)], turn @ direction, length * 0.68, radius * 0.5, depth + 1)

    grow(Vector((0.5, 5.6, -0.5)), Vector((-0.1, 0, 1)), 1.9, 0.17, 0)
    mesh_object("Tree", parts, bark)


# ---- the furniture -----------------------------------------------------------------------------------------------

BALUSTER = profile("2.2 0, 2.2 10, 3.6 20, 1.4 36, 2.6 56, 1.8 78")


def add_stairs(tread, panel, dark):
    """Thirteen steps along the right wall, rising to the back, with a banister."""
    x, count, rise, run, y = 1.5, 13, 0.2, 0.25, -0.55
    steps, treads = [], []
    for i in range(count):
        near, far, top = y + i * run, y + (i + 1) * run, (i + 1) * rise
        steps.append(box((x, near, 0), (HALF - 0.03, far, top - 0.035)))
        treads.append(box((x - 0.04, near - 0.03, top - 0.035), (HALF - 0.03, far, top)))
    feet = [Matrix.Translation((x + 0.02, y + (i + 0.5) * run, (i + 1) * rise)) for i in range(count)]
    posts = [moved(lathe(BALUSTER, 8), foot) for foot in feet]
    first, last = (x + 0.02, y - 0.1, 0.84), (x + 0.02, y + (count - 0.5) * run, count * rise + 0.79)
    newel = profile("7 0, 7 20, 4.5 26, 6 60, 4 80, 7 84, 7 90, 2 92, 5.5 97, 5 103, 1 106")
    rail = [beam(first, last, 0.065, 0.055), moved(lathe(newel, 16), Matrix.Translation((x + 0.02, y - 0.1, 0)))]
    mesh_object("StairSteps", steps, panel)
    mesh_object("StairTreads", treads, tread)
    mesh_object("Banister", [*posts, *rail], dark)


def chair(seat=0.45, width=0.42):
    """Four legs, a seat, a ladder back towards +y."""
    w = width / 2
    parts = [box((-w, -w, seat - 0.035), (w, w, seat))]
    for x in (0.03 - w, w - 0.03):
        parts.append(beam((x, 0.03 - w, 0), (x, 0.03 - w, seat - 0.03), 0.035, 0.035))
        parts.append(beam((x, w - 0.03, 0), (x, w + 0.05, 1.05), 0.035, 0.035))
    for i in range(3):
        y, z = w + 0.03 * i, 0.58 + 0.14 * i
        parts.append(box((0.03 - w, y - 0.01, z), (w - 0.03, y + 0.01, z + 0.06)))
    return [*parts, box((-w + 0.03, -w + 0.02, 0.2), (w - 0.03, -w + 0.04, 0.23))]


def add_table_and_chairs(dark, brass, shade):
    """A round table with an oil lantern; one chair turned to the window, one fallen over."""
    at = Matrix.Translation((-0.75, 0.55, 0))
    table = profile("24 0, 24 3, 6 8, 4.5 25, 7.5 45, 5 60, 10 69, 50 71, 52 72.5, 50 74")
    mesh_object("RoundTable", [moved(lathe(table, 40), at)], dark)
    point_light = profile("8.5 74, 8.5 75.5, 3 77.5, 2.5 81, 7.5 85, 8 89, 3 92.5, 4 94, 3 96, 1 105")
    at = at @ Matrix.Translation((0.08, -0.05, 0))
    mesh_object("PointLight", [moved(lathe(point_light, 28), at)], brass, smooth=True)
    mesh_object("PointLightShade", [moved(lathe(profile("15 100, 14 103, 7.5 114, 5 115"), 28), at)], shade, smooth=True)
    standing = Matrix.Translation((-1.35, -0.15, 0)) @ Matrix.Rotation(radians(-62), 4, "Z")
    fallen = Matrix.LocRotScale((0.50, -0.25, 0.215), Euler((0, radians(90), radians(35))), None)
    mesh_object("Chairs", [moved(p, m) for m in (standing, fallen) for p in chair()], dark)


def add_bookshelf(rng, dark, low, high, shelves=5):
    """A case between two corners, open to -y, half full of books."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    step = (z1 - z0) / shelves
    case = [box((x0, y0, z0), (x0 + 0.04, y1, z1)), box((x1 - 0.04, y0, z0), (x1, y1, z1))]
    case.append(box((x0, y1 - 0.02, z0), (x1, y1, z1)))
    case += [box((x0, y0, z0 + i * step), (x1, y1, z0 + i * step + 0.03)) for i in range(shelves)]
    case.append(box((x0 - 0.04, y0 - 0.03, z1), (x1 + 0.04, y1, z1 + 0.05)))
    mesh_object("Bookshelf", case, dark)
    books = []
    for i in range(shelves):
        x, end = x0 + 0.05, x1 - 0.06 - 0.4 * rng.random()
        while x < end:
            w, h = 0.025 + 0.035 * rng.random(), step * (0.6 + 0.25 * rng.random())
            book = box((0, 0, 0), (w - 0.003, 0.19, h))
            lean = Matrix.Rotation(0.22 if x + w > end else 0.0, 4, "Y")
            books.append(moved(book, Matrix.Translation((x, y0 + 0.04, z0 + i * step + 0.032)) @ lean))
            x += w

    def spines(tree):
        piece = tree.nodes.new("ShaderNodeNewGeometry").outputs["Random Per Island"]
        red, green, blue, tan = (0.18, 0.04, 0.03), (0.06, 0.08, 0.06), (0.05, 0.06, 0.10), (0.22, 0.10, 0.04)
        return ramp(tree, piece, (0.0, red), (1.0, (0.30, 0.24, 0.14)), (0.3, green), (0.6, blue), (0.8, tan))

    mesh_object("Books", books, surface("Books", spines, 0.6))


def add_clock(dark, brass):
    """A long case clock beside the back window."""
    at = Matrix.Translation((1.12, BACK - 0.2, 0))
    case = [box((-0.23, -0.14, 0), (0.23, 0.14, 0.4)), box((-0.17, -0.1, 0.4), (0.17, 0.14, 1.45))]
    case += [box((-0.23, -0.14, 1.45), (0.23, 0.14, 1.95)), box((-0.26, -0.17, 1.95), (0.26, 0.14, 2.0))]
    case += [beam((side * 0.25, 0, 2.0), (0, 0, 2.14), 0.28, 0.04) for side in (-1, 1)]
    mesh_object("Clock", [moved(p, at) for p in case], dark)
    facing = Matrix.Rotation(pi / 2, 4, "X")
    dial = moved(lathe(profile("17.5 0, 17.5 1.2, 16 1.6"), 32), Matrix.Translation((0, -0.14, 1.7)) @ facing)
    bob = moved(lathe(profile("7 0, 7 1, 5 1.6"), 20), Matrix.Translation((0.03, -0.1, 0.75)) @ facing)
    pendulum = beam((0, -0.105, 1.4), (0.03, -0.105, 0.8), 0.012, 0.008)
    mesh_object("ClockBrass", [moved(p, at) for p in (dial, bob, pendulum)], brass)
    minute = beam((0, -0.162, 1.7), (0.02, -0.162, 1.83), 0.014, 0.004)
    hour = beam((0, -0.164, 1.7), (-0.08, -0.164, 1.74), 0.018, 0.004)
    mesh_object("ClockHands", [moved(p, at) for p in (minute, hour)], dark)


def add_portrait(gilt):
    """A crooked portrait of nobody on the back wall."""
    at = Matrix.Translation((-1.08, BACK - 0.03, 1.75)) @ Matrix.Rotation(radians(5), 4, "Y")
    w, h, b = 0.24, 0.33, 0.05
    frame = [box((-w, -0.02, s * h - b / 2), (w, 0.02, s * h + b / 2)) for s in (-1, 1)]
    frame += [box((s * w - b / 2, -0.025, -h - b / 2), (s * w + b / 2, 0.02, h + b / 2)) for s in (-1, 1)]
    mesh_object("Frame", [moved(p, at) for p in frame], gilt)
    canvas = moved(box((-w, 0, -h), (w, 0.01, h)), at)
    mesh_object("Canvas", [canvas], surface("Canvas", (0.05, 0.045, 0.035), 0.25))
    head, body = lathe(profile("2 17, 8.5 10, 9 2, 3 -7"), 16), lathe(profile("5 -6, 17 -14, 22 -33"), 16)
    flat = at @ Matrix.Translation((0, -0.003, 0)) @ Matrix.Diagonal((1, 0.02, 1, 1))
    mesh_object("Sitter", [moved(p, flat) for p in (head, body)], surface("Sitter", (0.30, 0.24, 0.18), 0.4))


def add_rug_and_ball():
    carpet = mesh_object("Rug", [lathe(profile("98 0, 98 1.2"), 48)], surface("Rug", rug, 0.95))
    carpet.location, carpet.scale = (-0.45, 0.1, 0.003), (1.45, 1.0, 1.0)
    angles = [pi * (i + 0.05) / 12.1 for i in range(13)]
    red = surface("RedBall", (0.45, 0.02, 0.015), 0.2)
    ball = mesh_object("RedBall", [lathe([(0.11 * sin(a), -0.11 * cos(a)) for a in angles], 24)], red, smooth=True)
    ball.location = (1.02, -0.72, 0.113)


# ---- the scene ---------------------------------------------------------------------------------------------------


def set_cycles(scene):
    """Three bounces, no caustics, no clamp."""
    cycles = start_cycles(scene)
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces, cycles.transmission_bounces = 3, 3, 1, 0


def build(seed=13):
    """Fill the current, empty scene."""
    rng = random.Random(seed)
    walnut = wood((0.075, 0.036, 0.020), (0.27, 0.14, 0.075), (8, 8, 0.9))
    dark, panel = (
        surface("DarkWood", walnut, 0.38),
        surface("Panel", walnut, 0.8),
    )  # polished, and dull where it is large
    timber = surface("Timber", wood((0.13, 0.095, 0.068), (0.38, 0.29, 0.21)), 0.7)
    planks = surface("Planks", wood((0.20, 0.115, 0.062), (0.56, 0.37, 0.22)), 0.33)
    brass = surface("Brass", (0.80, 0.55, 0.22), 0.28, metallic=1.0)
    add_walls(surface("Wallpaper", wallpaper, 0.85), panel)
    add_floor(rng, planks)
    add_roof(rng, timber, timber)
    add_stairs(planks, panel, dark)
    add_table_and_chairs(dark, brass, surface("PointLightShade", (0.45, 0.38, 0.22), 0.5))
    add_bookshelf(rng, dark, (-2.3, 2.62, 0), (-1.52, BACK - 0.06, 2.1))
    add_clock(dark, brass)
    add_portrait(surface("Gilt", (0.55, 0.36, 0.12), 0.35, metallic=0.7))
    add_rug_and_ball()
    add_tree(rng, surface("Bark", (0.06, 0.05, 0.045), 0.9))
    moor = box((-20, BACK + 0.3, -0.6), (20, 30, -0.5))
    mesh_object("Moor", [moor], surface("Moor", (0.09, 0.095, 0.07), 1.0))
    add_camera((-0.30, -4.25, 1.42), (0.08, 2.5, 1.40), 33)
    add_daylight((-0.62, -0.30, 0.72), 5.0, (0.10, 0.16, 0.28), 0.8, color=(0.80, 0.88, 1.0))  # the moon, and night
    set_cycles(bpy.context.scene)


if __name__ == "__main__":
    sys.exit(write("house", build, sys.argv[1:]))
