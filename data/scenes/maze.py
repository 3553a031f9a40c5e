# SPDX-License-Identifier: GPL-3.0-or-later
"""A closed maze of rooms with doors: lights that see little of the scene, after [Kristensen2005, fig. 11].

By default nine rooms of 1.9 x 1.9 x 2 m on a square of 6 m, from (0, 0, 0), with walls of 0.1 m and ten doors of 0.7 x 1.6 m. The
doors are drawn by --seed: every room is reached, and --loops more are open. Room (i, j) has its middle at (1 + 2 i, 1 + 2 j, 1).
--rooms 8 --triangles 43000 is of the size of the article's maze. Receivers, each with the UV layer "lightmap": `Floor` (checkered),
`Ceiling`, `Walls` (a color for each room). Point lights `Light 1` … in every fourth room are for viewing.

    python data/scenes/maze.py OUT.blend [--rooms 3] [--triangles 43000] [--loops 2] [--seed 4]
"""

import random
import sys

import bpy
from house import noise, ramp, surface
from interior import add, area, arguments_of, carved, light, save, split
from staging import add_camera, start_cycles

PITCH, WALL, HEIGHT, DOOR = 2.0, 0.1, 2.0, (0.7, 1.6)  # m
COLORS = (
    (0.75, 0.72, 0.66),
    (0.72, 0.30, 0.22),
    (0.25, 0.45, 0.62),
    (0.76, 0.66, 0.30),
    (0.36, 0.55, 0.32),
    (0.60, 0.42, 0.60),
    (0.80, 0.80, 0.80),
)


def doors(rooms, loops, rng):
    """Pairs of adjacent rooms with a door between them: a random tree, and `loops` pairs more."""
    cells = [(i, j) for i in range(rooms) for j in range(rooms)]
    pairs = [((i, j), (i + a, j + b)) for i, j in cells for a, b in ((1, 0), (0, 1)) if (i + a, j + b) in cells]
    rng.shuffle(pairs)
    group, tree, rest = {cell: cell for cell in cells}, [], []
    for pair in pairs:
        one, two = (group[cell] for cell in pair)
        (rest if one == two else tree).append(pair)
        group = {cell: two if of == one else of for cell, of in group.items()}
    return tree + rest[:loops]


def free_boxes(rooms, open_doors, rng):
    """The rooms, and the openings of their doors at a random place in the wall."""
    half = (PITCH - WALL) / 2
    middles = {(i, j): ((i + 0.5) * PITCH, (j + 0.5) * PITCH) for i in range(rooms) for j in range(rooms)}
    boxes = [((x - half, y - half, 0), (x + half, y + half, HEIGHT)) for x, y in middles.values()]
    for one, two in open_doors:
        (x0, y0), (x1, y1) = middles[one], middles[two]
        shift = rng.choice((-0.45, 0.0, 0.45))
        x, y = (x0 + x1) / 2 + shift * (x0 == x1), (y0 + y1) / 2 + shift * (y0 == y1)
        wide, deep = DOOR[0] / 2, WALL / 2
        dx, dy = (deep, wide) if x0 != x1 else (wide, deep)
        boxes.append(((x - dx, y - dy, 0), (x + dx, y + dy, DOOR[1])))
    return boxes


def checkered(tree):
    """Stone in two shades, in squares of half a meter."""
    checker = tree.nodes.new("ShaderNodeTexChecker")
    checker.inputs["Scale"].default_value = 2.0
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], checker.inputs["Vector"])
    veins = ramp(tree, noise(tree, 3.0), (0.3, (0.40, 0.33, 0.27)), (0.7, (0.52, 0.46, 0.40)))
    tree.links.new(veins, checker.inputs["Color1"])
    checker.inputs["Color2"].default_value = (0.68, 0.66, 0.62, 1)
    return checker.outputs[0]


def build(rooms, triangles, loops, seed):
    rng = random.Random(seed)
    hull = ((-1, -1, -1), (rooms * PITCH + 1, rooms * PITCH + 1, HEIGHT + 1))
    boxes = free_boxes(rooms, doors(rooms, loops, rng), rng)
    shell = carved(hull, boxes)
    if triangles:
        shell = carved(hull, boxes, step=finest(shell, hull, boxes, triangles))
    paints = [surface(f"Paint {i}", color, 1.0) for i, color in enumerate(COLORS)]
    floor, ceiling = surface("Stone", checkered, 1.0), surface("Ceiling", (0.8, 0.8, 0.78), 1.0)
    of_room = {(i, j): paints[rng.randrange(len(paints))] for i in range(rooms) for j in range(rooms)}

    def of(middle, normal):
        """(object, material) of a face."""
        if abs(normal.z) > 0.5:
            return ("Floor", floor) if normal.z > 0 else ("Ceiling", ceiling)
        return "Walls", of_room[tuple(int((middle + normal * 0.02)[axis] // PITCH) for axis in (0, 1))]

    objects = {}
    for (name, material), part in split(shell, of).items():
        objects.setdefault(name, {})[material] = part
    for name, parts in objects.items():
        add(name, parts, None)
    for number, room in enumerate(range(0, rooms * rooms, 4)):
        place = (*(((room // rooms) + 0.5) * PITCH, ((room % rooms) + 0.5) * PITCH), 1.6)
        light(f"Light {number + 1}", "POINT", place, 40, shadow_soft_size=0.05)
    add_camera((0.15, 0.15, 1.5), (1.9, 1.9, 0.8), 18)
    cycles = start_cycles(bpy.context.scene)
    cycles.max_bounces = cycles.diffuse_bounces = 12


def finest(shell, hull, boxes, triangles):
    """The step (m) that divides the shell into about that many triangles: sides are divided into whole numbers of pieces."""
    even = (2 * area(shell) / triangles) ** 0.5
    steps = [even * 1.05**i for i in range(7)]
    return min(steps, key=lambda step: abs(2 * len(carved(hull, boxes, step=step)[1]) - triangles))


if __name__ == "__main__":
    options = arguments_of("maze", sys.argv[1:], rooms=3, triangles=0, loops=2, seed=4)
    sys.exit(save(options.out, lambda: build(options.rooms, options.triangles, options.loops, options.seed)))
