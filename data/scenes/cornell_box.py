# SPDX-License-Identifier: GPL-3.0-or-later
"""A closed Cornell box of 2 m with two blocks, after [Kristensen2005, fig. 7], and the same with a hole to a room beside it.

The free space is |x| < 1, |y| < 1, 0 < z < 2 (m): left wall red, right wall green. Receivers, each with the UV layer "lightmap":
`Room` (all walls, floor and ceiling), `Tall block`, `Short block`. With --hole, a window of 0.6 m in the left wall, 0.1 m thick, joins the
room to another of 1.4 x 2 x 2 m, whose surface is the receiver `Anteroom`. With --window, one of 0.8 m in the right wall is open; the
object `Outside` is the outside of the walls. A point light under the ceiling is for viewing. --step divides
walls into squares of that size (m), for receivers at vertices.

    python data/scenes/cornell_box.py OUT.blend [--hole] [--window] [--step 0.1]
"""

import sys
from math import radians

import bpy
from house import surface
from interior import add, arguments_of, carved, light, save, split
from mathutils import Matrix
from staging import add_camera, start_cycles

HULL = ((-1.1, -1.1, -0.1), (1.1, 1.1, 2.1))
ROOM = ((-1, -1, 0), (1, 1, 2))
WINDOW = ((1, -0.4, 0.8), (1.1, 0.4, 1.6))
HOLE, ANTEROOM = ((-1.1, -0.3, 0.7), (-1, 0.3, 1.3)), ((-2.5, -1, 0), (-1.1, 1, 2))  # m
RED, GREEN, WHITE = (0.63, 0.065, 0.05), (0.14, 0.45, 0.091), (0.73, 0.73, 0.73)


def build(hole, window, step):
    white, red, green = (surface(name, color, 1.0) for name, color in (("White", WHITE), ("Red", RED), ("Green", GREEN)))

    def of(middle, normal):
        """(object, material) of a face."""
        if window and any(not HULL[0][axis] < (middle + normal * 0.01)[axis] < HULL[1][axis] for axis in range(3)):
            return "Outside", white
        if middle.x < -1.05 or (abs(middle.x + 1.1) < 1e-3 and normal.x < 0):
            return "Anteroom", white
        return "Room", red if middle.x < -0.999 and normal.x > 0.9 else green if normal.x < -0.9 and middle.x > 0.999 else white

    hull = ((HULL[0][0] - 1.5 * hole, *HULL[0][1:]), HULL[1])
    openings = [ROOM, *((HOLE, ANTEROOM) if hole else ()), *((WINDOW,) if window else ())]
    shell = carved(hull, openings, step=step, outside=window)
    objects = {}
    for (name, material), part in split(shell, of).items():
        objects.setdefault(name, {})[material] = part
    for name, parts in objects.items():
        add(name, parts, None)
    for name, size, height, place, turn in (
        ("Tall block", 0.6, 1.2, (-0.36, 0.35), 17),
        ("Short block", 0.6, 0.6, (0.36, -0.28), -17),
    ):
        block = carved(((-size / 2, -size / 2, 0.002), (size / 2, size / 2, height)), [], step=step, outside=True)
        add(name, [block], white, matrix=Matrix.Translation((*place, 0)) @ Matrix.Rotation(radians(turn), 4, "Z"))
    light("Light", "POINT", (0, 0, 1.8), 40, shadow_soft_size=0.05)
    add_camera((0, -0.96, 1.0), (0, 1, 0.95), 17)
    cycles = start_cycles(bpy.context.scene, 600, 600)
    cycles.max_bounces = cycles.diffuse_bounces = 12


if __name__ == "__main__":
    options = arguments_of("cornell_box", sys.argv[1:], hole=False, window=False, step=1e9)
    sys.exit(save(options.out, lambda: build(options.hole, options.window, options.step)))
