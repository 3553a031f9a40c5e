# SPDX-License-Identifier: GPL-3.0-or-later
"""A table with glass on it: two rings, a ball and an angel of tinted glass, beside one opaque pawn.

The lightmap of the object `Table` (one quad, top at z = 0, UV layer = [0, 1]², u along +x, v along +y) responds to a sun
with caustics, colored shadows and one crisp shadow, after the scene "caustics" of [Wong2005, fig. 7].

By default the caustics are a stand-in, not traced: shadow rays pass straight through the glass, tinted by the angle at
which they meet it, see `glass`. Only the edges are noisy, so two samples per texel are enough. With --traced
the light really refracts, see `traced_glass`: the same error then needs a hundred times the samples.

    python data/scenes/caustics.py OUT.blend [--traced]
"""

import sys
from math import cos, pi, radians, sin

import bpy
from mathutils import Euler, Matrix, Vector
from staging import add_camera, add_daylight, start_cycles

TABLE_SIDE = 2.0  # m
TABLE_HEIGHT = 0.74  # m, the floor lies this far below the table's top
FADE, EVEN = (0.2, 1.0), 0.92  # m behind a glass over which its pattern fades, and what a wall passes beyond
ENTRY = 0.7  # roughness of traced glass, see `traced_glass`

# ---- shapes: every one is a list of rings of points, skinned with quads -----------------------------------------


def circle(radius, z, segments, fold=0.0, folds=0):
    """Points on a circle about the z axis whose radius swings by ±fold, `folds` times a turn."""
    angles = (2 * pi * i / segments for i in range(segments))
    return [Vector((cos(a), sin(a), 0)) * (radius + fold * cos(folds * a)) + Vector((0, 0, z)) for a in angles]


def outline(text):
    """Points (radius, height) in meters from "radius height, ..." in centimeters."""
    return [tuple(float(n) / 100 for n in pair.split()) for pair in text.split(",")]


def lathe(profile, segments):
    """Rings of a profile of (radius, z) turned about the z axis."""
    return [circle(radius, z, segments) for radius, z in profile]


def ball(radius, segments=24):
    """Rings of a sphere about the origin; the poles are tiny caps."""
    steps = segments // 2
    angles = [pi * (i + 0.02) / (steps + 0.04) for i in range(steps + 1)]
    return lathe([(radius * sin(a), -radius * cos(a)) for a in angles], segments)


def torus(major, minor, segments=96, sides=32):
    """Rings of a torus about the z axis, faces out (glass inside out refracts wrong); skin it `closed`."""
    rings = []
    for i in range(segments):
        turn = Matrix.Rotation(2 * pi * i / segments, 3, "Z")
        angles = (2 * pi * j / sides for j in range(sides))
        rings.append([turn @ Vector((major + minor * cos(a), 0, -minor * sin(a))) for a in angles])
    return rings


def tube(path, radii, segments=12):
    """Rings of a tube along a path of points."""
    rings = []
    for i, (point, radius) in enumerate(zip(path, radii, strict=True)):
        along = path[min(i + 1, len(path) - 1)] - path[max(i - 1, 0)]
        turn = along.to_track_quat("Z", "Y")
        rings.append([point + turn @ p for p in circle(radius, 0, segments)])
    return rings


def moved(rings, matrix):
    return [[matrix @ p for p in ring] for ring in rings]


def mesh_object(name, parts, material, closed=False, smooth=True):
    """One mesh object of several skinned parts. `closed`: the last ring joins the first, else both ends are capped."""
    points, faces = [], []
    for rings in parts:
        base, n = len(points), len(rings[0])
        points += [p for ring in rings for p in ring]
        for i in range(len(rings) if closed else len(rings) - 1):
            a, b = base + i * n, base + (i + 1) % len(rings) * n
            faces += [(a + j, a + (j + 1) % n, b + (j + 1) % n, b + j) for j in range(n)]
        if not closed:
            faces += [tuple(range(base + n - 1, base - 1, -1)), tuple(range(len(points) - n, len(points)))]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(p) for p in points], [], faces)
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    mesh.materials.append(material)
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(thing)
    return thing


# ---- materials --------------------------------------------------------------------------------------------------


def new_material(name):
    """An empty material with its output: (material, tree, the output's surface socket)."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # always there from Blender 5.0 on
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    return material, tree, tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"]


def node(tree, kind, **inputs):
    """A node whose named inputs are values, or sockets to link."""
    made = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in inputs.items():
        socket = made.inputs[name]
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return made


def calculate(tree, operation, *values):
    """The output of a Math node on numbers and sockets."""
    made = tree.nodes.new("ShaderNodeMath")
    made.operation = operation
    for socket, value in zip(made.inputs, values, strict=False):
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return made.outputs[0]


def glass(name, color, ior, rim, core, power):
    """The stand-in: glass that bends what the camera sees, and lets light through straight, tinted as a lens would gather it.

    A wall met at the cosine c passes color · (rim + (core - rim) · c^power), two walls its square, so that the middle of
    the shadow gains above 1 and its rim loses. Far behind the glass the pattern fades to EVEN, as light spreads past its
    focus. No shadow gains light as a whole: before the color, under a sun overhead, the ball passes 0.83 of what meets
    it, the flat ring 0.94, the leaning one 0.50, the angel's body 0.71, its wings 0.44, its foot 0.93, and the brightest
    foci are 2.4 (ball) and 2.1 (rings) times the lit table.
    """
    material, tree, surface = new_material(name)
    path = node(tree, "LightPath").outputs
    cosine = calculate(tree, "SUBTRACT", 1.0, node(tree, "LayerWeight", Blend=0.5).outputs["Facing"])
    lens = calculate(tree, "MULTIPLY_ADD", calculate(tree, "POWER", cosine, power), core - rim, rim)
    past = node(tree, "MapRange", Value=path["Ray Length"], **{"From Min": FADE[0], "From Max": FADE[1]}).outputs[0]
    gain = calculate(tree, "MULTIPLY_ADD", past, calculate(tree, "SUBTRACT", EVEN, lens), lens)
    transmission = node(tree, "VectorMath")
    transmission.operation = "SCALE"
    transmission.inputs[0].default_value = color
    tree.links.new(gain, transmission.inputs["Scale"])
    bent = node(tree, "BsdfGlass", Color=(*color, 1), Roughness=0.0, IOR=ior)
    straight = node(tree, "BsdfTransparent", Color=transmission.outputs[0])
    mix = node(tree, "MixShader", Fac=path["Is Shadow Ray"])
    tree.links.new(bent.outputs[0], mix.inputs[1])
    tree.links.new(straight.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], surface)
    return material


def traced_glass(name, color, ior, **_):
    """Glass that really refracts: behind a diffuse bounce it is rough from inside, where the path meets the sun.

    Only next event estimation finds a sun of angle 0, and only through a rough wall: ENTRY blurs the foci, so that there
    are any. What the camera sees is smooth. `glass` takes the same arguments; the lens of the stand-in is ignored.
    """
    material, tree, surface = new_material(name)
    met = calculate(tree, "MINIMUM", node(tree, "LightPath").outputs["Diffuse Depth"], 1.0)
    inside = node(tree, "NewGeometry").outputs["Backfacing"]
    roughness = calculate(tree, "MULTIPLY", calculate(tree, "MULTIPLY", met, inside), ENTRY)
    bent = node(tree, "BsdfGlass", Color=(*color, 1), Roughness=roughness, IOR=ior)
    tree.links.new(bent.outputs[0], surface)
    return material


def solid(name, color, roughness, metallic=0.0):
    material, tree, surface = new_material(name)
    looks = {"Base Color": (*color, 1), "Roughness": roughness, "Metallic": metallic}
    tree.links.new(node(tree, "BsdfPrincipled", **looks).outputs[0], surface)
    return material


def grained(name, light, dark, stretch, diffuse=False):
    """Wood: noise stretched along y in object space, as a diffuse or a slightly glossy surface."""
    material, tree, surface = new_material(name)
    place = node(tree, "Mapping", Vector=node(tree, "TexCoord").outputs["Object"], Scale=stretch)
    noise = node(tree, "TexNoise", Vector=place.outputs[0], Scale=2.0, Detail=5.0, Distortion=0.6)
    ramp = node(tree, "ValToRGB", Fac=noise.outputs[0])
    ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[0].color = 0.3, (*dark, 1)
    ramp.color_ramp.elements[1].position, ramp.color_ramp.elements[1].color = 0.7, (*light, 1)
    if diffuse:
        shader = node(tree, "BsdfDiffuse", Color=ramp.outputs[0])
    else:
        shader = node(tree, "BsdfPrincipled", **{"Base Color": ramp.outputs[0], "Roughness": 0.4})
    tree.links.new(shader.outputs[0], surface)
    return material


# ---- the things -------------------------------------------------------------------------------------------------


def add_table():
    """The receiver: one quad. Its border and legs are another object, flush below it."""
    h = TABLE_SIDE / 2
    mesh = bpy.data.meshes.new("Table")
    mesh.from_pydata([(-h, -h, 0), (h, -h, 0), (h, h, 0), (-h, h, 0)], [], [(0, 1, 2, 3)])
    mesh.uv_layers.new(name="lightmap").data.foreach_set("uv", [0, 0, 1, 0, 1, 1, 0, 1])
    mesh.materials.append(grained("Maple", (0.80, 0.74, 0.64), (0.72, 0.63, 0.51), (9, 0.8, 1), diffuse=True))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Table", mesh))

    walnut = grained("Walnut", (0.20, 0.10, 0.05), (0.10, 0.045, 0.02), (6, 1, 6))
    rim = [(h, -0.002), (h + 0.03, -0.002), (h + 0.04, -0.015), (h + 0.03, -0.035), (h - 0.02, -0.06), (h - 0.1, -0.06)]
    square = [Vector((x, y, 0)) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    slab = [[p * r + Vector((0, 0, z)) for p in square] for r, z in reversed(rim)]
    mesh_object("TableSlab", [slab], walnut, smooth=False)
    bottom = 0.01 - TABLE_HEIGHT
    turned = [(0.028, bottom), *outline("4 -60, 3 -57, 4.5 -54, 5.5 -25, 3.5 -20, 5.5 -17, 5.5 -5")]
    corners = [Matrix.Translation(p * (h - 0.12)) for p in square]
    mesh_object("TableLegs", [moved(lathe(turned, 16), m) for m in corners], walnut)


def add_rings(glass):
    """One glass ring lies flat, another stands and leans."""
    clear = glass("ClearGlass", (0.97, 0.99, 0.98), 1.5, rim=0.35, core=1.45, power=5)
    flat = mesh_object("Ring", [torus(0.30, 0.075, 80, 24)], clear, closed=True)
    flat.location = (0.36, -0.38, 0.0755)
    aqua = glass("AquaGlass", (0.62, 0.93, 0.97), 1.5, rim=0.4, core=1.45, power=5)
    tilted = mesh_object("LeaningRing", [torus(0.18, 0.052, 80, 24)], aqua, closed=True)
    tilted.rotation_euler = Euler((radians(60), 0, radians(35)))
    tilted.location = (-0.52, -0.42, 0.18 * sin(radians(60)) + 0.0525)


def feather(angle, length, side):
    """A long flat ellipsoid from the shoulder, `angle` above the horizon."""
    lobe = moved(ball(0.5, 16), Matrix.Diagonal((length, 0.03, 0.13, 1)) @ Matrix.Rotation(pi / 2, 4, "Y"))
    out = Matrix.Rotation(-angle, 4, "Y") @ Matrix.Translation((length / 2, 0, 0))
    sweep = Matrix.Rotation(radians(22), 4, "Z")
    wing = moved(lobe, Matrix.Translation((0.03, 0.05, 0.50)) @ sweep @ out)
    return wing if side > 0 else [ring[::-1] for ring in moved(wing, Matrix.Diagonal((-1, 1, 1, 1)))]  # normals out


def add_angel(place, glass):
    """A robed figure 0.75 m high with two fanned wings, a halo and a pedestal."""
    amber = glass("AmberGlass", (0.98, 0.72, 0.42), 1.35, rim=0.75, core=1.0, power=1)
    azure = glass("AzureGlass", (0.70, 0.83, 0.99), 1.25, rim=0.8, core=1.0, power=1)
    gold = solid("Gold", (0.95, 0.68, 0.28), 0.25, metallic=1.0)
    profile = outline("15.5 5, 15 10, 12.5 20, 9.8 30, 7.8 38, 7.4 42, 8.6 48, 8.8 52")
    robe = [circle(r, z, 72, 0.016 * max(0, 1 - z / 0.42), 9) for r, z in profile]
    robe += lathe(outline("7 55.5, 3.2 57.5, 2.8 60"), 72)
    head = moved(ball(0.062), Matrix.Translation((0, -0.006, 0.655)) @ Matrix.Diagonal((0.9, 1, 1.12, 1)))
    parts = [robe, head]
    for side in (-1, 1):
        shoulder, elbow, wrist, hand = (
            (0.08, 0.0, 0.515),
            (0.118, -0.05, 0.42),
            (0.06, -0.12, 0.42),
            (0.012, -0.13, 0.47),
        )
        path = [Vector((side * x, y, z)) for x, y, z in (shoulder, elbow, wrist, hand)]
        parts.append(tube(path, (0.03, 0.036, 0.026, 0.016)))
    body = mesh_object("Angel", parts, amber)
    fan = [(radians(62 - 21 * i), 0.46 - 0.045 * abs(i - 1)) for i in range(6)]
    wings = mesh_object("AngelWings", [feather(a, length, s) for s in (-1, 1) for a, length in fan], azure)
    halo = mesh_object("AngelHalo", [torus(0.075, 0.008, 48, 10)], gold, closed=True)
    halo.matrix_basis = Matrix.Translation((0, 0.02, 0.765)) @ Matrix.Rotation(radians(12), 4, "X")
    foot = mesh_object("AngelFoot", [lathe(outline("17 0.05, 17 2, 16.5 3, 16 4.8"), 48)], azure)
    for part in (body, wings, halo, foot):
        part.matrix_basis = place @ part.matrix_basis


def add_crystal_ball(glass):
    """A solid ball: the focus moves round it with the sun."""
    crystal = glass("CrystalGlass", (0.99, 0.985, 0.96), 1.5, rim=0.3, core=1.65, power=3)
    mesh_object("CrystalBall", [ball(0.2, 48)], crystal).location = (0.56, 0.38, 0.2005)


def add_pawn():
    """The opaque thing: a dark pawn with a crisp shadow."""
    profile = outline("8.5 0.05, 8.8 2, 7.5 3.5, 5.5 5, 4 9, 3.2 15, 3.4 17.5, 5.8 18.5, 3 20")
    top = moved(ball(0.056), Matrix.Translation((0, 0, 0.245)))
    pawn = mesh_object("Pawn", [lathe(profile, 40), top], solid("Ebony", (0.035, 0.02, 0.022), 0.25))
    pawn.location = (-0.10, -0.62, 0)


# ---- the scene --------------------------------------------------------------------------------------------------


def set_cycles(scene, caustics):
    """Few bounces, caustics where they are traced, and transparent bounces enough for wings behind wings."""
    cycles = start_cycles(scene)
    cycles.caustics_reflective = cycles.caustics_refractive = caustics
    cycles.blur_glossy = 0.0
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = 10, 1, 4
    cycles.transmission_bounces, cycles.transparent_max_bounces = 10, 32


def build(traced):
    """Fill the current, empty scene, with the glass that really refracts or with its stand-in."""
    kind = traced_glass if traced else glass
    add_table()
    add_rings(kind)
    add_angel(Matrix.Translation((-0.22, 0.26, 0)) @ Matrix.Rotation(radians(14), 4, "Z"), kind)
    add_crystal_ball(kind)
    add_pawn()
    corners = ((-5, -5), (5, -5), (5, 5), (-5, 5))
    floor = [[Vector((x, y, z)) for x, y in corners] for z in (-TABLE_HEIGHT - 0.02, -TABLE_HEIGHT)]
    mesh_object("Floor", [floor], solid("Stone", (0.16, 0.15, 0.15), 0.6), smooth=False)
    add_camera((1.15, -2.35, 1.75), (0.0, -0.08, 0.12), 42)
    add_daylight((-0.55, 0.35, 0.75), 3.0, (0.30, 0.38, 0.50), 0.35)
    set_cycles(bpy.context.scene, caustics=traced)
    for thing in bpy.context.scene.objects:
        if thing.active_material and thing.active_material.name.endswith("Glass"):
            thing.visible_diffuse = traced  # the stand-in lets what the table scatters pass unchanged


def main(arguments):
    if not arguments or not arguments[0].endswith(".blend") or arguments[1:] not in ([], ["--traced"]):
        print("usage: python data/scenes/caustics.py OUT.blend [--traced]", file=sys.stderr)
        return 2
    bpy.ops.wm.read_factory_settings(use_empty=True)
    build(traced="--traced" in arguments)
    bpy.ops.wm.save_as_mainfile(filepath=arguments[0], check_existing=False)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
