# SPDX-License-Identifier: GPL-3.0-or-later
"""A struck coin on dark felt, seen straight from above, as a dome of lights would photograph it for RTI.

What it shows is relief: a sun with a face and sixteen rays, a legend on either side, beads and a rim, struck in bronze and
worn since. From overhead it is nearly flat; under a raking light every letter, scratch and pit throws its shadow. The
legend SOL OMNIBVS LVCET, the sun shines for all, is Petronius's.

The coin is a field of heights on a raster, sampled by a mesh of quads that fill a disc. It is modeled with a radius of
1 m, as if seen through a glass of fifty times. The bronze is bright where hands have rubbed it and brown, dull and green in its recesses.

    python data/scenes/coin.py OUT.blend
"""

import sys
from math import pi

import bpy
import numpy as np
from staging import add_camera, add_daylight, start_cycles, write

RASTER = 1250  # heights a side, over [-1, 1]²
QUADS = 480  # of the mesh, a side
EDGE = 0.13  # m from the field down to the felt
FACE = 0.315  # m, radius of the sun's face
LEGEND = 0.735  # m, radius of the letters' feet

# ---- heights: every array is (RASTER, RASTER), row 0 at y = -1, in meters above the field -------------------------


def raster():
    """(x, y) of the raster's points."""
    line = (np.arange(RASTER) + 0.5) / RASTER * 2 - 1
    return np.meshgrid(line, line)


def blurred(image, sigma):
    """Convolved with a Gaussian of `sigma` meters, through its Fourier transform."""
    frequency = np.fft.fftfreq(RASTER, 2 / RASTER)
    line = np.exp(-2 * (pi * sigma * frequency) ** 2)
    return np.fft.irfft2(np.fft.rfft2(image) * line[:, None] * line[None, : RASTER // 2 + 1], image.shape)


def step(x, low, high):
    """0 below `low`, 1 above `high`, smooth between."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def bump(x, y, at, size):
    """A Gaussian hill of height 1, mirrored in x where `at` is off the axis."""
    sides = (at[0],) if at[0] == 0 else (-at[0], at[0])
    return sum(np.exp(-0.5 * (((x - s) / size[0]) ** 2 + ((y - at[1]) / size[1]) ** 2)) for s in sides)


def egg(x, y, at, size):
    """The upper half of an ellipsoid of height 1, mirrored in x where `at` is off the axis."""
    x = np.abs(x) if at[0] else x
    return np.sqrt(np.maximum(0, 1 - ((x - at[0]) / size[0]) ** 2 - ((y - at[1]) / size[1]) ** 2))


def stroke(x, y, start, bow, end, width):
    """A soft line from start to end of height 1 that bows up by `bow` in its middle, mirrored in x."""
    t = np.clip((np.abs(x) - start[0]) / (end[0] - start[0]), 0, 1)
    line = start[1] + (end[1] - start[1]) * t + 4 * bow * t * (1 - t)
    beyond = np.abs(x) - (start[0] + (end[0] - start[0]) * t)
    return np.exp(-0.5 * (((y - line) / width) ** 2 + (beyond / width) ** 2))


def face(x, y):
    """A full face on the unit disc, in units of its radius."""
    h = 0.34 * egg(x, y, (0, 0), (1, 1))
    h += 0.05 * bump(x, y, (0, 0.55), (0.40, 0.18)) + 0.11 * bump(x, y, (0.46, -0.20), (0.21, 0.19))
    h += 0.10 * bump(x, y, (0, -0.70), (0.16, 0.11)) - 0.05 * bump(x, y, (0, -0.545), (0.16, 0.03))
    h -= 0.15 * bump(x, y, (0.33, 0.14), (0.16, 0.10)) + 0.06 * bump(x, y, (0.13, 0.20), (0.05, 0.08))  # sockets
    h += 0.10 * stroke(x, y, (0.12, 0.27), 0.09, (0.60, 0.27), 0.045)  # brows
    h += 0.105 * egg(x, y, (0.335, 0.13), (0.155, 0.085))
    h += 0.04 * stroke(x, y, (0.17, 0.12), 0.10, (0.51, 0.13), 0.020) + 0.03 * stroke(x, y, (0.18, 0.11), -0.075, (0.50, 0.12), 0.016)
    h -= 0.05 * bump(x, y, (0.335, 0.14), (0.030, 0.030))  # pupils
    along = np.clip((0.34 - y) / 0.52, 0, 1)
    bridge = (0.09 + 0.15 * along**1.3) * np.exp(-0.5 * (x / (0.055 + 0.035 * along)) ** 2)
    h += bridge * step(y, -0.235, -0.15) * step(-y, -0.48, -0.25)
    h += 0.10 * bump(x, y, (0.115, -0.155), (0.045, 0.042)) - 0.05 * bump(x, y, (0.06, -0.225), (0.03, 0.016))
    h -= 0.045 * stroke(x, y, (0.19, -0.20), 0.02, (0.34, -0.42), 0.030)  # from the nose to the mouth's corners
    h += 0.085 * stroke(x, y, (0.04, -0.345), 0.012, (0.20, -0.385), 0.034) + 0.10 * bump(x, y, (0, -0.465), (0.11, 0.036))
    h -= 0.085 * stroke(x, y, (0.0, -0.402), -0.012, (0.27, -0.375), 0.016)
    return h


def rays(x, y, pairs=8):
    """Straight rays with a roof's ridge and waved ones with a groove, in turn, about the face."""
    r, turn, pitch, h = np.hypot(x, y), np.arctan2(x, y), 2 * pi / pairs, np.zeros_like(x)
    for waved in (False, True):
        top = 0.61 if waved else 0.64
        t = np.clip((r - FACE) / (top - FACE), 0, 1)
        bearing = (turn - waved * pitch / 2 + pitch / 2) % pitch - pitch / 2  # from the nearest ray of its kind
        sway = waved * 0.022 * np.sin(2 * pi * 1.5 * t) * (1 - 0.5 * t)
        off = np.abs(bearing * r - sway) / (0.062 * (1 - 0.93 * t) * (0.85 if waved else 1.0))
        section = np.sqrt(np.maximum(0, 1 - off**2)) - 0.4 * np.exp(-0.5 * (off / 0.22) ** 2) if waved else np.maximum(0, 1 - off)
        h = np.maximum(h, np.where((r > 0.8 * FACE) & (r < top), section * (0.034 - 0.012 * t), 0))
    return h


def beads(x, y, count=76, radius=0.868, size=0.0235):
    """A circle of half balls within the rim."""
    pitch = 2 * pi / count
    bearing = np.arctan2(y, x)
    across = (bearing - np.round(bearing / pitch) * pitch) * radius
    return 1.1 * np.sqrt(np.maximum(0, size**2 - across**2 - (np.hypot(x, y) - radius) ** 2))


def text_triangles(text, size):
    """Triangles (T, 3, 2) of a line of Blender's own font, its middle at x = 0, its feet at y = 0."""
    curve = bpy.data.curves.new("Legend", "FONT")
    curve.body, curve.size, curve.align_x, curve.space_character, curve.resolution_u = text, size, "CENTER", 1.16, 6
    curve.offset = 0.005  # bolder
    line = bpy.data.objects.new("Legend", curve)
    mesh = line.to_mesh()
    mesh.calc_loop_triangles()
    points = np.array([v.co[:2] for v in mesh.vertices])
    triangles = points[[t.vertices[:] for t in mesh.loop_triangles]]
    line.to_mesh_clear()
    bpy.data.objects.remove(line)
    bpy.data.curves.remove(curve)
    return triangles


def bent(points, radius, below):
    """Points of a straight line of text laid along a circle, its top or (`below`) its bottom."""
    around, out = points[..., 0] / radius, radius + (-1 if below else 1) * points[..., 1]
    return np.stack([out * np.sin(around), (-1 if below else 1) * out * np.cos(around)], -1)


def filled(triangles):
    """1 where the raster's points lie in a triangle."""
    x, y = raster()
    image = np.zeros_like(x)
    for corners in triangles:
        low, high = (
            np.clip(((edge + 1) / 2 * RASTER).astype(int) + (0, 1)[i], 0, RASTER) for i, edge in enumerate((corners.min(0), corners.max(0)))
        )
        window = (slice(low[1], high[1]), slice(low[0], high[0]))
        sides = []
        for a, b in zip(corners, np.roll(corners, -1, 0), strict=True):
            sides.append((b[0] - a[0]) * (y[window] - a[1]) - (b[1] - a[1]) * (x[window] - a[0]))
        sides = np.array(sides)
        image[window] = np.maximum(image[window], (sides >= 0).all(0) | (sides <= 0).all(0))
    return image


def legend():
    """The letters, raised with rounded shoulders."""
    upper = bent(text_triangles("SOL OMNIBVS LVCET", 0.155), LEGEND - 0.024, below=False)
    lower = bent(text_triangles("* S R B F *", 0.155), LEGEND + 0.084, below=True)
    solid = filled(np.concatenate([upper, lower]))
    return 0.026 * step(blurred(solid, 0.0055), 0.25, 0.85)


def wear(x, y, rng):
    """Scratches and pits, to be taken away."""
    lost = np.zeros_like(x)
    for _ in range(110):  # scratches, each within the window that it touches
        middle, turn, length = rng.uniform(-0.95, 0.95, 2), rng.uniform(0, pi), rng.uniform(0.03, 0.40) ** 1.5
        depth, width = rng.uniform(0.0008, 0.0024), rng.uniform(0.0025, 0.005)
        window = _window(middle, length + 0.03)
        u, v = x[window] - middle[0], y[window] - middle[1]
        along, across = u * np.cos(turn) + v * np.sin(turn), v * np.cos(turn) - u * np.sin(turn)
        across = across - 0.12 * along**2
        lost[window] += depth * np.exp(-0.5 * (across / width) ** 2) * step(length - np.abs(along), 0, 0.02)
    for _ in range(260):
        middle, size = rng.uniform(-1, 1, 2), rng.uniform(0.004, 0.013)
        window = _window(middle, 4 * size)
        lost[window] += 0.45 * size * np.exp(-0.5 * ((x[window] - middle[0]) ** 2 + (y[window] - middle[1]) ** 2) / size**2)
    return lost


def _window(middle, reach):
    first = np.clip(((middle - reach + 1) / 2 * RASTER).astype(int), 0, RASTER)
    last = np.clip(((middle + reach + 1) / 2 * RASTER).astype(int), 0, RASTER)
    return slice(first[1], last[1]), slice(first[0], last[0])


def relief(seed):
    """The coin's heights (R, R) in meters, and where it has kept its patina (R, R) in [0, 1]."""
    rng = np.random.default_rng(seed)
    x, y = raster()
    r = np.hypot(x, y)
    struck, middle = np.zeros_like(x), _window(np.zeros(2), FACE)
    struck[middle] = FACE * 0.54 * np.where(r[middle] < FACE, face(x[middle] / FACE, y[middle] / FACE), 0)
    struck = np.maximum(struck, np.where(r < FACE, 0.016, 0) + rays(x, y))
    struck += 0.010 * np.exp(-0.5 * ((r - 0.675) / 0.006) ** 2)  # a thread between the sun and its legend
    rim = 0.043 * step(r, 0.905, 0.925)
    heights = blurred(np.maximum(np.maximum(struck, legend()), np.maximum(beads(x, y), rim)), 0.0032)
    heights -= 0.35 * np.maximum(0, heights - 0.043)  # what stands highest is rubbed down
    cloth = blurred(rng.standard_normal(x.shape), 0.045)
    grain = blurred(rng.standard_normal(x.shape), 0.006)
    heights += 0.0022 * cloth / cloth.std() + 0.00016 * grain / grain.std() - 0.02 * r**2  # a die is never quite flat
    smooth = heights.copy()
    heights = heights - wear(x, y, rng)
    spots = blurred(rng.standard_normal(x.shape), 0.03)
    hollow = (blurred(smooth, 0.035) - smooth) / 0.010 + (smooth - heights) / 0.006
    return heights, step(hollow + 0.35 * spots / spots.std(), -0.3, 1.9)


# ---- the things --------------------------------------------------------------------------------------------------


def disc_of_square(n):
    """Points (n + 1, n + 1, 2) of a square grid drawn out to the unit disc, squares to circles."""
    line = np.linspace(-1, 1, n + 1)
    a, b = np.meshgrid(line, line)
    wide = np.abs(a) > np.abs(b)
    radius = np.where(wide, a, b)
    ratio = np.divide(np.where(wide, b, a), radius, out=np.zeros_like(a), where=radius != 0)
    turn = np.where(wide, ratio, 2 - ratio) * pi / 4
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)], -1)


def sampled(image, points):
    """Bilinear, at points (..., 2) of [-1, 1]²."""
    place = np.clip((points + 1) / 2 * RASTER - 0.5, 0, RASTER - 1.001)
    first, t = place.astype(int), place % 1
    (i, j), (u, v) = np.moveaxis(first, -1, 0), np.moveaxis(t, -1, 0)
    low = image[j, i] * (1 - u) + image[j, i + 1] * u
    return low * (1 - v) + (image[j + 1, i] * (1 - u) + image[j + 1, i + 1] * u) * v


def mesh_object(name, points, quads, material):
    """A smooth mesh of points (V, 3) and quads (F, 4)."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points.tolist(), [], quads.tolist())
    mesh.polygons.foreach_set("use_smooth", np.ones(len(quads), bool))
    mesh.materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, mesh))
    return mesh


def add_coin(seed):
    """The struck side and the edge below it, one mesh with its patina as an attribute of the vertices."""
    heights, kept = relief(seed)
    n = QUADS
    plane = disc_of_square(n)
    inner = np.minimum(1, np.hypot(plane[..., 0], plane[..., 1]))
    top = sampled(heights, plane) - 0.035 * (1 - np.sqrt(np.maximum(0, 1 - np.maximum(0, (inner - 0.965) / 0.035) ** 2)))
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], -1).reshape(-1, 4)
    border = np.concatenate([index[0, :-1], index[:-1, -1], index[-1, :0:-1], index[:0:-1, 0]])
    below = (n + 1) ** 2 + np.arange(len(border))
    edge = np.stack([np.roll(border, -1), border, below, np.roll(below, -1)], -1)
    points = np.concatenate([plane, top[..., None]], -1).reshape(-1, 3)
    foot = points[border] * (1, 1, 0) - (0, 0, EDGE)
    mesh = mesh_object("Coin", np.concatenate([points, foot]), np.concatenate([quads, edge]), bronze())
    patina = np.concatenate([sampled(kept, plane).ravel(), np.ones(len(foot))])
    mesh.attributes.new("patina", "FLOAT", "POINT").data.foreach_set("value", patina.astype(np.float32))


def add_felt():
    corners = np.array([(-4, -4, -EDGE), (4, -4, -EDGE), (4, 4, -EDGE), (-4, 4, -EDGE)])
    mesh_object("Felt", corners, np.array([(0, 1, 2, 3)]), felt())


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


def ramp(tree, value, *stops):
    """Colors at positions along a value in [0, 1]."""
    made = node(tree, "ValToRGB", Fac=value)
    for i, (position, color) in enumerate(stops):
        stop = made.color_ramp.elements[i] if i < 2 else made.color_ramp.elements.new(position)
        stop.position, stop.color = position, (*color, 1)
    return made.outputs[0]


def bronze():
    """Bright metal where the patina is gone; brown and half diffuse, then green, where it is kept."""
    material, tree, surface = new_material("Bronze")
    kept = node(tree, "Attribute")
    kept.attribute_name = "patina"
    kept = kept.outputs["Fac"]
    color = ramp(tree, kept, (0.0, (0.93, 0.66, 0.36)), (1.0, (0.12, 0.17, 0.12)), (0.35, (0.72, 0.43, 0.20)), (0.7, (0.27, 0.14, 0.07)))
    speckle = node(tree, "TexNoise", Vector=node(tree, "TexCoord").outputs["Object"], Scale=38.0, Detail=2.0).outputs[0]
    dull = node(tree, "MapRange", Value=kept, **{"To Min": 0.41, "To Max": 0.50}).outputs[0]
    rough = node(tree, "Math")
    rough.operation = "MULTIPLY_ADD"
    tree.links.new(speckle, rough.inputs[0])
    rough.inputs[1].default_value = 0.10
    tree.links.new(dull, rough.inputs[2])
    metal = node(tree, "MapRange", Value=kept, **{"To Min": 0.75, "To Max": 0.25}).outputs[0]
    shader = node(tree, "BsdfPrincipled", **{"Base Color": color, "Roughness": rough.outputs[0], "Metallic": metal})
    tree.links.new(shader.outputs[0], surface)
    return material


def felt():
    """Dark blue, matted."""
    material, tree, surface = new_material("Felt")
    place = node(tree, "TexCoord").outputs["Object"]
    fibres = node(tree, "TexNoise", Vector=place, Scale=55.0, Detail=3.0, Roughness=0.7, Distortion=1.5).outputs[0]
    color = ramp(tree, fibres, (0.3, (0.012, 0.020, 0.040)), (0.7, (0.050, 0.075, 0.130)))
    rough = node(tree, "Bump", Height=fibres, Strength=0.5, Distance=0.02).outputs[0]
    tree.links.new(node(tree, "BsdfDiffuse", Color=color, Normal=rough).outputs[0], surface)
    return material


# ---- the scene ---------------------------------------------------------------------------------------------------


def set_cycles(scene):
    """Two bounces, no caustics, no clamp; a square picture."""
    cycles = start_cycles(scene, 800, 800)
    cycles.min_light_bounces = 2
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces, cycles.transmission_bounces = 2, 1, 1, 0


def build(seed=7):
    """Fill the current, empty scene."""
    add_coin(seed)
    add_felt()
    camera = add_camera((0, 0, 4), (0, 0, 0), 50)  # straight down, +y up
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.24
    add_daylight((-0.6, 0.45, 0.5), 3.0, (0.40, 0.45, 0.52), 0.25, color=(1.0, 0.95, 0.88))
    set_cycles(bpy.context.scene)


if __name__ == "__main__":
    sys.exit(write("coin", build, sys.argv[1:]))
