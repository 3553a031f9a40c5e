# SPDX-License-Identifier: GPL-3.0-or-later
"""A court with two storeys of colonnades around it, open to the air: many receivers, after the atrium of [Kristensen2005, fig. 10].

The court is |x| < 8, |y| < 4 (m), the aisles around it are 3 m deep: their outer walls stand at |x| = 11, |y| = 7; storeys are 4 m high,
with floors at z = 0 and 4.4. About 120,000 triangles, none on the outside. Receivers, each with the UV layer "lightmap": `Floors`, `Walls`,
`Ceilings`, `Columns lower`, `Columns upper`, `Arches lower`, `Arches upper`, `Balustrade`, `Drapes` (red, green, blue). A sun and the
world come in from above, and four point lights hang in the aisles, for viewing.

    python data/scenes/atrium.py OUT.blend [--step 0.35]
"""

import sys
from math import cos, pi, sin

import bpy
from house import box, lathe, moved, noise, profile, ramp, skin, surface
from interior import add, arguments_of, carved, light, save, split
from mathutils import Matrix, Vector
from staging import add_camera, add_daylight, start_cycles

COURT, AISLE, STOREY, SLAB, WALL = (8.0, 4.0), 3.0, 4.0, 0.4, 0.4  # m
LINE, SPRING, RADIUS = 0.35, 2.95, 0.75  # m: of the columns behind the court's edge; where arches begin, and theirs
FINE = 1 / 1024  # between the charts of many small parts
SHAFT = "1 0.2, 34 0.2, 34 10, 30 13, 33 17, 33 21, 27 25, 27 28, 24.5 32, 25 90, 24 160, 22 235, 21.5 248, 24 251, 24 254, 22 256, 23 262"
CAPITAL = "26 268, 31 274, 33 278, 33 282, 1 282"
BALUSTER = "1 14, 6 14, 6 18, 4 21, 6.5 32, 7 40, 4 55, 3.5 62, 5 66, 6 68, 6 72, 1 72"


def corners():
    """Centers of columns, in a ring, two (x, y) for each bay."""
    x, y = COURT[0] + LINE, COURT[1] + LINE
    ring = [(-x + 2 * x * i / 8, -y) for i in range(8)] + [(x, -y + 2 * y * i / 4) for i in range(4)]
    ring += [(-a, -b) for a, b in ring]
    return list(zip(ring, ring[1:] + ring[:1], strict=True))


def along(start, end, z):
    """The frame of a bay: x from column to column, z up."""
    step = Vector((*end, 0)) - Vector((*start, 0))
    return Matrix.Translation((*start, z)) @ step.to_track_quat("X", "Z").to_matrix().to_4x4(), step.length


def arch(width):
    """A wall on two columns, with a round arch cut out of it."""
    path = [(0.001, SPRING), (width / 2 - RADIUS, SPRING)]
    path += [(width / 2 - RADIUS * cos(pi * i / 24), SPRING + RADIUS * sin(pi * i / 24)) for i in range(1, 24)]
    path += [(width / 2 + RADIUS, SPRING), (width - 0.001, SPRING)]
    top = STOREY - 0.002
    return skin([[Vector(p) for p in ((x, -0.2, z), (x, 0.2, z), (x, 0.2, top), (x, -0.2, top))] for x, z in path])


def storey(name, z, stone, marble):
    bays = [along(*bay, z) for bay in corners()]
    column = [lathe(profile(f"{SHAFT}, {CAPITAL}"), 24), box((-0.34, -0.34, 2.822), (0.34, 0.34, SPRING - 0.002))]
    add(f"Columns {name}", [moved(part, frame) for frame, _ in bays for part in column], marble, flat=False, gap=FINE)
    add(f"Arches {name}", [moved(arch(width), frame) for frame, width in bays], stone, flat=False, gap=FINE)


def balustrade(stone):
    parts, post = [], lathe(profile(BALUSTER), 8)
    for frame, width in (along(*bay, STOREY + SLAB + 0.002) for bay in corners()):
        rail = [box((0.36, -0.08, 0.722), (width - 0.36, 0.08, 0.82)), box((0.36, -0.08, 0.0), (width - 0.36, 0.08, 0.138))]
        places = [0.45 + (width - 0.9) * i / 5 for i in range(6)]
        parts += [moved(part, frame) for part in rail]
        parts += [moved(post, frame @ Matrix.Translation((x, 0, 0))) for x in places]
    add("Balustrade", parts, stone, flat=False, gap=FINE)


def drape(x, y, wide, high, rows=24, columns=28):
    """Cloth that hangs in folds over the rail, in the plane y."""
    places = [(wide * (i / columns - 0.5), high * j / rows) for j in range(rows + 1) for i in range(columns + 1)]
    points = [Vector((x + u * (1 - 0.12 * v / high), y + 0.06 * sin(14 * u + x) * (0.3 + v / high), 5.15 - v)) for u, v in places]
    n = columns + 1
    faces = [(j * n + i, j * n + i + 1, (j + 1) * n + i + 1, (j + 1) * n + i) for j in range(rows) for i in range(columns)]
    return points, faces


def drapes():
    cloths = [
        surface(name, color, 1.0) for name, color in (("Red", (0.6, 0.05, 0.04)), ("Green", (0.08, 0.36, 0.1)), ("Blue", (0.06, 0.12, 0.5)))
    ]
    parts = {}
    for i, material in enumerate(cloths):
        (p, f), (q, g) = (drape(-4.2 + 4.2 * i, y, 1.4, 2.2) for y in (COURT[1] - 0.1, 0.1 - COURT[1]))
        parts[material] = p + q, f + [tuple(len(p) + k for k in face) for face in g]
    add("Drapes", parts, None, flat=False)


def shell(step, stone):
    paving = surface("Paving", lambda tree: ramp(tree, noise(tree, 2.0), (0.3, (0.36, 0.28, 0.22)), (0.7, (0.55, 0.47, 0.38))), 1.0)
    plaster = surface("Plaster", lambda tree: ramp(tree, noise(tree, 0.8), (0.35, (0.62, 0.48, 0.32)), (0.65, (0.72, 0.60, 0.45))), 1.0)
    x, y = COURT[0] + AISLE, COURT[1] + AISLE
    roof = 2 * STOREY + SLAB
    hull = ((-x - WALL, -y - WALL, -WALL), (x + WALL, y + WALL, roof + WALL))
    floors = [((-x, -y, z), (x, y, z + STOREY)) for z in (0.0, STOREY + SLAB)]
    court = ((-COURT[0], -COURT[1], 0.0), (COURT[0], COURT[1], roof + WALL))

    def of(middle, normal):
        """(object, material) of a face."""
        if abs(middle.x) > x + 0.01 or abs(middle.y) > y + 0.01 or not -0.01 < middle.z < roof + 0.01:
            return "", None
        if abs(normal.z) > 0.5:
            return ("Floors", paving) if normal.z > 0 else ("Ceilings", stone)
        return "Walls", plaster if max(abs(middle.x) - COURT[0], abs(middle.y) - COURT[1]) > 1 else stone

    objects = {}
    for (name, material), part in split(carved(hull, [*floors, court], step=step, outside=True), of).items():
        objects.setdefault(name, {})[material] = part
    for name in ("Floors", "Walls", "Ceilings"):
        add(name, objects[name], None)


def build(step):
    stone = surface("Stone", lambda tree: ramp(tree, noise(tree, 1.2), (0.3, (0.54, 0.49, 0.41)), (0.7, (0.70, 0.66, 0.58))), 1.0)
    marble = surface("Marble", (0.72, 0.69, 0.63), 1.0)
    shell(step, stone)
    storey("lower", 0.0, stone, marble)
    storey("upper", STOREY + SLAB, stone, marble)
    balustrade(stone)
    drapes()
    add_daylight((0.25, -0.35, 0.9), 4.0, (0.45, 0.60, 0.85), 0.6)
    for i, (x, y) in enumerate(((-5, 5.6), (5, 5.6), (-5, -5.6), (5, -5.6))):
        light(f"Light {i + 1}", "POINT", (x, y, 3.2), 60, (1.0, 0.75, 0.5), shadow_soft_size=0.05)
    add_camera((-7.3, -2.6, 1.7), (4.0, 1.6, 3.4), 18)
    cycles = start_cycles(bpy.context.scene)
    cycles.max_bounces = cycles.diffuse_bounces = 8


if __name__ == "__main__":
    options = arguments_of("atrium", sys.argv[1:], step=0.35)
    sys.exit(save(options.out, lambda: build(options.step)))
