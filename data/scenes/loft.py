# SPDX-License-Identifier: GPL-3.0-or-later
"""A furnished loft with 24 lights of every kind, each by its name: for light mixing, and for lights carried through rooms.

Living room, kitchen and bedroom behind a partition with a doorway; inside |0 .. 8| x |0 .. 5| x |0 .. 3| m, about 200 m² of surface.
The walls are 0.25 m thick, so the sun and the world come in through the windows alone. Receivers, each with the UV layer "lightmap":
`Floor`, `Ceiling`, `Walls`, `Partition` and all furniture (`Sofa`, `Rug`, `Dining table`, `Bed`, …); `Facade` is the outside.

`Picture` hangs on the wall behind the sofa, `Painting` in the bedroom: plain canvases, which may be made to emit. With --unlit nothing
emits, so that all light is added after the bake; with --diffuse nothing is glossy. The collection `Receivers` has all objects but
`NO_RECEIVERS`, side by side in the UV layer "atlas".

Lights: World, Sun; points Pendant 1-3, Desk light, Bedside left, Bedside right, Reading light; spots Track spot 1-4, Picture spot; areas
Ceiling panel, Counter strip, Mirror panel; emissive objects TV, Neon sign, Shelf strip, Paper globe, Stove, Alarm clock, Aquarium.
The collections `Living room`, `Kitchen` and `Bedroom` hold them as groups, without World and Sun.

    python data/scenes/loft.py OUT.blend [--unlit] [--diffuse]
"""

import sys
from math import radians

import bpy
from house import noise, ramp, surface, wood
from interior import add, arguments_of, carved, light, save, split
from lightmap_charts import share_atlas
from loft_furniture import emissive_objects, furnish
from mathutils import Vector
from staging import add_camera, add_daylight, start_cycles

SIZE = (8.0, 5.0, 3.0)  # m
THICK, PARTITION = 0.25, (5.5, 5.6)  # m
WINDOWS = (((0.8, 0.9), (2.4, 2.5)), ((3.4, 0.9), (5.0, 2.5)), ((6.2, 0.9), (7.6, 2.3)))  # (x, z) in the wall at y = 0
WARM, COOL, DAY = (1.0, 0.75, 0.48), (0.75, 0.86, 1.0), (0.55, 0.70, 1.0)
TRACK = (  # m: the spots on the ceiling, and where they look
    ((1.2, 2.5, 2.9), (0.6, 2.6, 0.0)),
    ((2.6, 2.5, 2.9), (2.0, 2.0, 0.0)),
    ((3.6, 3.6, 2.9), (3.6, 4.9, 1.0)),
    ((5.0, 3.6, 2.9), (5.0, 4.9, 1.0)),
)
GROUPS = {
    "Living room": ("Reading light", "Track spot 1", "Track spot 2", "Ceiling panel", "TV", "Neon sign", "Shelf strip", "Aquarium"),
    "Kitchen": ("Pendant 1", "Pendant 2", "Pendant 3", "Track spot 3", "Track spot 4", "Counter strip", "Stove"),
    "Bedroom": ("Desk light", "Bedside left", "Bedside right", "Picture spot", "Mirror panel", "Paper globe", "Alarm clock"),
}
ATLAS = "atlas"
NO_RECEIVERS = ("Facade", "Neon sign", "Shelf strip", "Paper globe", "Alarm clock", "Shade 1", "Shade 2", "Shade 3")  # outside, or thin


def plaster(low, high):
    """Paint on plaster, uneven by a few percent."""
    return lambda tree: ramp(tree, noise(tree, 1.5), (0.35, low), (0.65, high))


def shell():
    hull = ((-THICK, -THICK, -THICK), (SIZE[0] + THICK, SIZE[1] + THICK, SIZE[2] + THICK))
    openings = [((a, -THICK, b), (c, 0, d)) for (a, b), (c, d) in WINDOWS]
    wall = ((PARTITION[0], 0, 0), (PARTITION[1], SIZE[1], SIZE[2]))
    doorway = ((PARTITION[0], 2.1, 0), (PARTITION[1], 3.0, 2.1))
    before, behind = ((0, 0, 0), (PARTITION[0], *SIZE[1:])), ((PARTITION[1], 0, 0), SIZE)
    part = carved(hull, [before, behind, *openings, doorway], outside=True)
    paint = surface("Paint", plaster((0.74, 0.71, 0.65), (0.80, 0.78, 0.73)), 1.0)
    brick = surface("Brick", plaster((0.38, 0.16, 0.10), (0.52, 0.24, 0.16)), 1.0)
    blue, white = surface("Blue", (0.30, 0.42, 0.55), 1.0), surface("White", (0.82, 0.82, 0.80), 1.0)
    boards = surface("Boards", wood((0.26, 0.15, 0.08), (0.50, 0.33, 0.19), stretch=(0.8, 8, 8)), 1.0)

    def of(middle, normal):
        """(object, material) of a face."""
        inside = middle + normal * 0.01
        if any(not 0 < inside[axis] < SIZE[axis] for axis in (0, 2)) or inside.y > SIZE[1] or inside.y < -THICK:
            return "Facade", paint
        if normal.z > 0.5 and inside.y >= 0:
            return "Floor", boards
        if normal.z < -0.5 and inside.y >= 0 and middle.z > 2.5:
            return "Ceiling", white
        if wall[0][0] - 0.01 < middle.x < wall[1][0] + 0.01 and inside.y > 0:
            return "Partition", blue if normal.x > 0.5 else paint
        return "Walls", brick if normal.x > 0.5 else blue if normal.x < -0.5 and middle.x > 7 else paint

    objects = {}
    for (name, material), faces in split(part, of).items():
        objects.setdefault(name, {})[material] = faces
    for name, parts in objects.items():
        add(name, parts, None)


def lights():
    """The seventeen that are not objects: their watts are a room's in the evening."""
    add_daylight(Vector((-0.35, -0.8, 0.5)), 4.0, DAY, 1.0)
    for i, x in enumerate((3.8, 4.3, 4.8)):
        light(f"Pendant {i + 1}", "POINT", (x, 2.0, 1.72), 12, WARM, shadow_soft_size=0.03)
    light("Desk light", "POINT", (7.5, 0.4, 1.15), 10, COOL, shadow_soft_size=0.03)
    light("Bedside left", "POINT", (5.95, 4.72, 0.75), 5, WARM, shadow_soft_size=0.05)
    light("Bedside right", "POINT", (7.84, 4.72, 0.75), 5, WARM, shadow_soft_size=0.05)
    light("Reading light", "POINT", (0.45, 3.1, 1.45), 14, WARM, shadow_soft_size=0.08)
    beam = {"spot_size": radians(50), "spot_blend": 0.4, "shadow_soft_size": 0.02}
    for i, (place, target) in enumerate(TRACK):
        light(f"Track spot {i + 1}", "SPOT", place, 60, (1.0, 0.9, 0.78), target, **beam)
    light("Picture spot", "SPOT", (7.0, 2.9, 2.9), 40, WARM, (7.95, 2.8, 1.4), **beam)
    rectangle = {"shape": "RECTANGLE"}
    light("Ceiling panel", "AREA", (2.0, 2.2, 2.97), 45, (1, 1, 1), (2.0, 2.2, 0), size=1.2, size_y=0.6, **rectangle)
    light("Counter strip", "AREA", (4.3, 4.75, 1.48), 12, COOL, (4.3, 4.75, 0), size=2.0, size_y=0.06, **rectangle)
    light("Mirror panel", "AREA", (7.97, 1.8, 1.6), 15, (1, 0.95, 0.9), (0, 1.8, 1.6), size=0.4, size_y=1.0, **rectangle)


def group():
    """Every light in the collection of its room."""
    scene = bpy.context.scene
    for name, members in GROUPS.items():
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        for member in members:
            collection.objects.link(scene.objects[member])
            scene.collection.objects.unlink(scene.objects[member])


def receivers():
    """The objects of the demo's lightmap, in a collection and an atlas of their own."""
    collection = bpy.data.collections.new("Receivers")
    bpy.context.scene.collection.children.link(collection)
    things = [thing for thing in bpy.data.objects if thing.type == "MESH" and thing.name not in NO_RECEIVERS]
    for thing in things:
        collection.objects.link(thing)
    share_atlas(things, ATLAS)


def build(unlit, diffuse):
    shell()
    furnish(diffuse)
    emissive_objects(unlit)
    lights()
    group()
    receivers()
    add_camera((0.5, 0.45, 1.9), (4.4, 3.3, 0.95), 17)
    cycles = start_cycles(bpy.context.scene)
    cycles.max_bounces = cycles.diffuse_bounces = 8


if __name__ == "__main__":
    options = arguments_of("loft", sys.argv[1:], unlit=False, diffuse=False)
    sys.exit(save(options.out, lambda: build(options.unlit, options.diffuse)))
