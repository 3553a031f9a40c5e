# SPDX-License-Identifier: GPL-3.0-or-later
"""A closed room of 4 x 3 x 2.5 m that a screen of blue cloth parts, with a lampshade of paper: light that passes through surfaces.

The free space is 0 < x < 4, 0 < y < 3, 0 < z < 2.5 (m). `Screen` stands at x = 2.2 and leaves a gap beside it, above and below; it lets
more light through than it reflects. `Shade` is an open cylinder that lets through as much as it reflects.

    python data/scenes/cloth_screen.py OUT.blend
"""

import sys
from math import cos, pi, sin

import bpy
from house import box, surface
from interior import add, arguments_of, carved, save, split
from mathutils import Vector
from staging import add_camera, start_cycles
from studio import SIZE, translucent

CORNERS = 24  # of the lampshade


def build():
    white, red, floor = (surface(*told, 1.0) for told in (("White", (0.7,) * 3), ("Red", (0.6, 0.12, 0.08)), ("Floor", (0.4, 0.3, 0.2))))
    hull = (tuple(-0.1 for _ in SIZE), tuple(side + 0.1 for side in SIZE))
    add("Room", split(carved(hull, [((0, 0, 0), SIZE)]), lambda middle, n: floor if n.z > 0.9 else red if n.x > 0.9 else white), None)
    screen = [Vector((2.2, y, z)) for y, z in ((0.0, 0.1), (2.1, 0.1), (2.1, 2.2), (0.0, 2.2))]
    add("Screen", [(screen, [(0, 1, 2, 3)])], translucent("Blue cloth", (0.15, 0.2, 0.3), (0.3, 0.45, 0.6)))
    turns = [2 * pi * i / CORNERS for i in range(CORNERS)]
    rings = [Vector((1 + 0.25 * cos(turn), 2.2 + 0.25 * sin(turn), z)) for z in (1.0, 1.45) for turn in turns]
    sides = [(i, (i + 1) % CORNERS, CORNERS + (i + 1) % CORNERS, CORNERS + i) for i in range(CORNERS)]
    add("Shade", [(rings, sides)], translucent("Paper", (0.4, 0.325, 0.2), (0.4, 0.325, 0.2)))
    add("Box", [box((0.7, 0.5, 0.002), (1.3, 1.1, 0.7))], white)
    add("Block", [box((3.0, 0.6, 0.002), (3.5, 1.2, 1.1))], red)
    add_camera((0.3, 0.2, 1.7), (2.4, 2.0, 0.8), 18)
    cycles = start_cycles(bpy.context.scene, 600, 450)
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 12


if __name__ == "__main__":
    options = arguments_of("cloth_screen", sys.argv[1:])
    sys.exit(save(options.out, build))
