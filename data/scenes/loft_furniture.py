# SPDX-License-Identifier: GPL-3.0-or-later
"""The furniture of `loft.py`: objects with lightmap coordinates, 2 mm off what they stand on, and those that emit light."""

from math import pi

from house import box, lathe, moved, noise, profile, ramp, surface, wood
from interior import add, joined
from interior import glow as emission
from mathutils import Euler, Matrix, Vector

CONE = ((0.17, 0.0), (0.06, 0.16), (0.015, 0.2))  # m: radius and height of a shade
LACQUER, BLACK = ("Lacquer", (0.78, 0.78, 0.76)), ("Black", (0.03, 0.03, 0.035))
OFF = 0.002  # m between an object and what it stands on


def at(x, y, z=0.0, turn=0.0):
    return Matrix.Translation((x, y, z + OFF)) @ Matrix.Rotation(turn, 4, "Z")


def legs(x, y, height, side=0.05):
    """Four legs at the corners (±x, ±y)."""
    half = side / 2
    return [box((a * x - half, b * y - half, 0), (a * x + half, b * y + half, height)) for a in (-1, 1) for b in (-1, 1)]


def table(x, y, height, top=0.04):
    return [*legs(x - 0.06, y - 0.06, height - top - OFF), box((-x, -y, height - top), (x, y, height))]


def chair():
    back = [box((-0.2, 0.18, 0.5), (0.2, 0.21, 0.92))]
    return [*legs(0.19, 0.19, 0.438, 0.035), box((-0.22, -0.22, 0.44), (0.22, 0.22, 0.49)), *back]


def furnish(diffuse):
    """All but what emits; `diffuse`: without gloss and metal."""
    oak = surface("Oak", wood((0.30, 0.17, 0.08), (0.52, 0.34, 0.18)), 1.0)
    cloth, wool = surface("Cloth", (0.10, 0.22, 0.30), 1.0), surface("Wool", (0.62, 0.20, 0.10), 1.0)
    linen = surface("Linen", (0.72, 0.70, 0.64), 1.0)
    lacquer, black = (surface(*of, 1.0 if diffuse else gloss) for of, gloss in ((LACQUER, 0.45), (BLACK, 0.5)))
    steel = surface("Steel", (0.55, 0.56, 0.58), 1.0 if diffuse else 0.35, metallic=1.0)
    add("Rug", [box((-1.2, -0.9, 0), (1.2, 0.9, 0.012))], wool, matrix=at(1.9, 1.9))
    seats = [box((-1.0 + i, -0.35, 0.16), (-0.02 + i, 0.42, 0.44)) for i in (0.0, 1.0)]
    arms = [box((x, -0.35, 0), (x + 0.18, 0.64, 0.62)) for x in (-1.2, 1.02)]
    frame = [box((-1.0, 0.44, 0), (1.0, 0.64, 0.82)), box((-1.0, -0.33, 0.02), (1.0, 0.42, 0.14))]
    add("Sofa", [*seats, *arms, *frame], cloth, matrix=at(1.9, 3.2))
    add("Coffee table", table(0.55, 0.35, 0.40), oak, matrix=at(1.9, 1.9, 0.012))
    add("TV bench", [box((-0.9, -0.2, 0.08), (0.9, 0.2, 0.45)), box((-0.8, -0.15, 0), (0.8, 0.15, 0.078))], oak, matrix=at(1.9, 0.35))
    add("TV frame", [box((-0.62, -0.03, 0.47), (0.62, 0.0, 1.22))], black, matrix=at(1.9, 0.32))
    add("Dining table", table(0.85, 0.45, 0.75), oak, matrix=at(4.3, 2.0))
    for i, (x, y, turn) in enumerate(((3.9, 1.35, pi), (4.7, 1.38, pi + 0.2), (3.9, 2.65, 0), (4.7, 2.62, -0.15))):
        add(f"Chair {i + 1}", chair(), oak, matrix=at(x, y, 0, turn))
    cabinet = [box((-1.1, -0.3, 0.1), (1.1, 0.3, 0.88)), box((-1.08, -0.3, 0), (1.08, 0.24, 0.098))]
    add("Kitchen counter", cabinet, lacquer, matrix=at(4.3, 4.68))
    add("Worktop", [box((-1.12, -0.32, 0.882), (1.12, 0.302, 0.92))], steel, matrix=at(4.3, 4.68))
    add("Cupboards", [box((-1.1 + 0.74 * i, -0.17, 1.5), (-0.38 + 0.74 * i, 0.17, 2.2)) for i in range(3)], lacquer, matrix=at(4.3, 4.81))
    boards = [box((-0.6, -0.15, z), (0.6, 0.15, z + 0.03)) for z in (0.05, 0.45, 0.85, 1.25, 1.65, 2.05)]
    add("Shelf", [*boards, *[box((x, -0.15, 0), (x + 0.03, 0.15, 2.1)) for x in (-0.632, 0.602)]], oak, matrix=at(0.18, 4.1, 0, pi / 2))
    books = [box((-0.5 + 0.07 * i, -0.1, 0), (-0.444 + 0.07 * i, 0.1, 0.2 + 0.02 * (i * 7 % 5))) for i in range(12)]
    for row, z in enumerate((0.482, 0.882, 1.282)):
        colors = (wool, cloth, linen)
        parts = {paint: joined(books[i::3]) for i, paint in enumerate(colors[row:] + colors[:row])}
        add(f"Books {row + 1}", parts, None, matrix=at(0.18, 4.1, z, pi / 2))
    mattress, head = box((-0.8, -1.0, 0.25), (0.8, 1.0, 0.5)), box((-0.85, 1.002, 0), (0.85, 1.05, 1.0))
    add("Bed", [mattress, head, *legs(0.7, 0.9, 0.248, 0.08)], linen, matrix=at(7.0, 3.85))
    add("Pillows", [box((x, 0.55, 0.504), (x + 0.6, 0.95, 0.62)) for x in (-0.7, 0.1)], cloth, matrix=at(7.0, 3.85))
    for name, x in (("Bedside left", 5.95), ("Bedside right", 7.84)):
        add(f"{name} table", [box((-0.14, -0.2, 0), (0.14, 0.2, 0.45))], oak, matrix=at(x, 4.72))
    add("Desk", table(0.6, 0.32, 0.74), oak, matrix=at(7.2, 0.36))
    add("Desk chair", chair(), oak, matrix=at(7.2, 0.95, 0, 0.3))
    add("Wardrobe", [box((-0.3, -0.6, 0.05), (0.3, 0.6, 2.2))], lacquer, matrix=at(5.92, 0.68))
    canvas = surface("Canvas", lambda tree: ramp(tree, noise(tree, 1.2), (0.40, (0.62, 0.30, 0.16)), (0.60, (0.75, 0.68, 0.52))), 1.0)
    add("Picture", [box((-0.65, -0.015, 0), (0.65, 0, 0.9))], canvas, matrix=at(2.3, 4.998, 1.15))
    add("Painting", [box((-0.4, -0.015, 0), (0.4, 0, 0.6))], canvas, matrix=at(7.998, 2.8, 1.1, -pi / 2))
    shade = lathe(CONE, 24)
    for i, x in enumerate((3.8, 4.3, 4.8)):
        add(f"Shade {i + 1}", [shade], black, flat=False, matrix=at(x, 2.0, 1.75))


def emissive_objects(unlit):
    """Seven objects that light the room; `unlit` ones are of their color by day."""

    def glow(name, color, strength):
        return surface(name, tuple(0.1 + 0.5 * c for c in color), 1.0) if unlit else emission(name, color, strength)

    add("TV", [box((-0.6, 0.002, 0.49), (0.6, 0.006, 1.2))], glow("Screen", (0.35, 0.55, 1.0), 4.0), matrix=at(1.9, 0.32))
    stroke = [Vector((0, y, z)) for y, z in ((0, 0), (0.12, 0.4), (0.24, 0.05), (0.36, 0.4), (0.48, 0), (0.62, 0), (0.62, 0.4))]
    tubes = []
    for a, b in zip(stroke, stroke[1:], strict=False):
        turn = (b - a).to_track_quat("Z", "X").to_matrix().to_4x4()
        tubes.append(moved(lathe([(0.012, 0.0), (0.012, (b - a).length)], 8), Matrix.Translation(a) @ turn))
    add("Neon sign", tubes, glow("Neon", (1.0, 0.12, 0.30), 30.0), flat=False, matrix=at(0.06, 1.4, 1.7))
    strip = box((-0.55, 0.13, 2.03), (0.55, 0.14, 2.045))
    add("Shelf strip", [strip], glow("Strip", (1.0, 0.72, 0.40), 40.0), matrix=at(0.18, 4.1, 0, pi / 2))
    ball = lathe(profile("1 -20, 8 -18.5, 14 -14, 18.5 -8, 20 0, 18.5 8, 14 14, 8 18.5, 1 20"), 24)
    add("Paper globe", [ball], glow("Paper", (1.0, 0.85, 0.62), 8.0), flat=False, matrix=at(7.0, 2.2, 2.2))
    add("Stove", [box((-0.2, -0.002, 0.3), (0.2, 0.002, 0.6))], glow("Fire", (1.0, 0.35, 0.08), 6.0), matrix=at(4.7, 4.365))
    clock = moved(box((-0.05, -0.006, 0), (0.05, 0.006, 0.04)), Euler((0.2, 0, 0)).to_matrix().to_4x4())
    add("Alarm clock", [clock], glow("Digits", (1.0, 0.05, 0.02), 10.0), matrix=at(7.84, 4.6, 0.46, pi))
    add("Aquarium", [box((-0.3, -0.12, 0), (0.3, 0.12, 0.3))], glow("Water", (0.20, 0.75, 0.85), 3.0), matrix=at(1.0, 4.82, 0.9))
    add("Aquarium stand", [box((-0.32, -0.14, 0), (0.32, 0.14, 0.896))], surface("Ebony", (0.06, 0.05, 0.05), 0.8), matrix=at(1.0, 4.82))
