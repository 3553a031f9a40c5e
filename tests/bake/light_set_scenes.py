"""Small scenes with lights inside them: `python light_set_scenes.py NAME OUT.blend`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy

ODD_NAMES = ("Bulb, left=1", "Fenêtre/№ 2", "Tall  Screen")  # of lights: what flags, files and lists might trip over
FACES = {
    "Floor": (0, 1, 2, 3),
    "Ceiling": (4, 7, 6, 5),
    "West": (0, 3, 7, 4),
    "East": (1, 5, 6, 2),
    "South": (0, 4, 5, 1),
    "North": (3, 2, 6, 7),
}


def material(name: str, shader: str, color: tuple[float, float, float], strength: float | None = None) -> Any:
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes = made.node_tree.nodes
    nodes.clear()
    node = nodes.new(shader)
    node.inputs["Color"].default_value = (*color, 1)
    if strength is not None:
        node.inputs["Strength"].default_value = strength
    made.node_tree.links.new(node.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def gray(value: float = 0.5) -> Any:
    return material("Gray", "ShaderNodeBsdfDiffuse", (value, value, value))


def mesh(name: str, corners: Any, faces: Any, made_of: Any) -> Any:
    """An object of quads, without the corners that they leave; its faces share its UV layer in columns."""
    data = bpy.data.meshes.new(name)
    used = sorted({corner for face in faces for corner in face})
    data.from_pydata([corners[corner] for corner in used], [], [[used.index(corner) for corner in face] for face in faces])
    for i, loop in enumerate(data.uv_layers.new(name="UV").uv):
        x, y = ((0.02, 0.02), (0.98, 0.02), (0.98, 0.98), (0.02, 0.98))[i % 4]
        loop.vector = ((i // 4 + x) / len(faces), y)
    data.materials.append(made_of)
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def corners_of(low: tuple[float, float, float], high: tuple[float, float, float]) -> list[tuple[float, float, float]]:
    (x0, y0, z0), (x1, y1, z1) = low, high
    return [(x, y, z) for z in (z0, z1) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]


def light(name: str, kind: str, place: tuple[float, float, float], energy: float, **values: Any) -> Any:
    obj = bpy.data.objects.new(name, bpy.data.lights.new(name, kind))
    obj.location, obj.data.energy = place, energy
    for key, value in values.items():
        setattr(obj.data, key, value)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def walls(made_of: Any = None) -> None:
    """A closed room of 3 x 2 x 2 m, floor apart from the rest, and a crate; a camera looks at the floor."""
    places = corners_of((0, 0, 0), (3, 2, 2))
    mesh("Floor", places, [FACES["Floor"]], made_of or gray())
    mesh("Walls", places, [face for name, face in FACES.items() if name != "Floor"], made_of or gray())
    mesh("Crate", corners_of((2, 1.2, 0), (2.5, 1.7, 0.6)), [face[::-1] for face in FACES.values()], made_of or gray(0.7))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.3, 0.3, 1.8), (0.9, 0, -0.9)
    camera.data.lens = 20
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.context.scene.render.engine = "CYCLES"
    bpy.context.scene.cycles.max_bounces = bpy.context.scene.cycles.diffuse_bounces = 4


def room() -> None:
    """The room with four lights in it: two bulbs, the first of them in a collection with a screen that emits, and a panel."""
    walls()
    first = light(ODD_NAMES[0], "POINT", (0.7, 0.7, 1.5), 20, shadow_soft_size=0.1)
    light(ODD_NAMES[1], "SPOT", (2.2, 1.0, 1.8), 40, shadow_soft_size=0.1, color=(1, 0.5, 0.2))
    screen = mesh(ODD_NAMES[2], [(0.02, 0.4, 0.6), (0.02, 1.4, 0.6), (0.02, 1.4, 1.4), (0.02, 0.4, 1.4)], [(0, 1, 2, 3)], gray())
    screen.data.materials[0] = material("Glow", "ShaderNodeEmission", (0.2, 0.5, 1), 6)
    panel = mesh("Panel", [(1, 0.5, 1.95), (1, 1.5, 1.95), (1.6, 1.5, 1.95), (1.6, 0.5, 1.95)], [(0, 1, 2, 3)], gray())
    panel.data.materials[0] = material("Panel", "ShaderNodeEmission", (1, 0.9, 0.8), 4)
    corner = bpy.data.collections.new("Corner seat")
    bpy.context.scene.collection.children.link(corner)
    for obj in (first, screen):
        corner.objects.link(obj)
    empty = bpy.data.collections.new("Nothing lit")
    bpy.context.scene.collection.children.link(empty)
    empty.objects.link(bpy.data.objects["Crate"])


def shining_metal(obj: Any, color: tuple[float, float, float], strength: float) -> None:
    """Give an object a metal that emits, by a Principled BSDF in a node group."""
    group = bpy.data.node_groups.new("Shining metal", "ShaderNodeTree")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    metal = group.nodes.new("ShaderNodeBsdfPrincipled")
    values = {"Metallic": 1.0, "Base Color": (0.9, 0.9, 0.9, 1), "Emission Color": (*color, 1), "Emission Strength": strength}
    for name, value in values.items():
        metal.inputs[name].default_value = value
    group.links.new(metal.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    made = bpy.data.materials.new("Shining metal")
    made.use_nodes = True
    made.node_tree.nodes.clear()
    node = made.node_tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    made.node_tree.links.new(node.outputs[0], made.node_tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    obj.data.materials[0] = made


def unlit() -> None:
    walls()


def designed() -> None:
    """The room under a light of every kind, none of them simple: a spot with a blend in nodes, a turned panel, a disk, a sun; and others
    that have no counterpart."""
    walls()
    bpy.data.objects.remove(bpy.data.objects["Walls"])
    places = corners_of((0, 0, 0), (3, 2, 2))
    mesh("Walls", places, [FACES[name] for name in ("West", "North", "South")], gray())  # a sun shines in from the east and above
    light("Bulb", "POINT", (0.6, 1.4, 1.2), 14, color=(1, 0.8, 0.5), shadow_soft_size=0)
    light("Globe", "POINT", (2.2, 0.5, 1.4), 9, color=(0.5, 0.8, 1), shadow_soft_size=0.08, use_soft_falloff=False)
    spot = light("Spot", "SPOT", (1.4, 1.6, 1.8), 20, exposure=1, spot_size=1.1, spot_blend=0.4, shadow_soft_size=0.1)
    spot.rotation_euler = (-0.35, 0.2, 0)
    spot.data.use_nodes = True
    emission = next(node for node in spot.data.node_tree.nodes if node.type == "EMISSION")
    emission.inputs["Strength"].default_value, emission.inputs["Color"].default_value = 1.5, (0.4, 1, 0.4, 1)
    panel = light("Panel", "AREA", (0.4, 0.6, 1.5), 7, shape="RECTANGLE", size=0.4, size_y=0.6)
    panel.rotation_euler, panel.scale = (0.2, 0.5, 0.3), (0.5, 1, 1)
    disk = light("Disk", "AREA", (2.2, 1.2, 1.6), 5, shape="DISK", size=0.3)
    disk.rotation_euler = (-0.6, 0, 0)
    sun = light("Sun", "SUN", (0, 0, 5), 1.2, color=(1, 0.9, 0.7), angle=0.02)
    sun.rotation_euler = (0.25, 0.6, 0)
    haze = light("Haze", "SUN", (0, 0, 5), 0.5, color=(0.6, 0.8, 1), angle=0.5)
    haze.rotation_euler = (-0.2, 0.7, 0)
    light("Off", "POINT", (1, 1, 1), 0)
    light("Hidden", "POINT", (1, 1, 1), 10).hide_render = True
    light("Portal", "AREA", (1, 1, 3), 10).data.cycles.is_portal = True
    light("Narrow", "AREA", (1, 1, 1.9), 0.001, spread=0.5)
    profile = light("Profile", "POINT", (1, 1, 1), 0.001)
    profile.data.use_nodes = True
    nodes = profile.data.node_tree.nodes
    shader = next(node for node in nodes if node.type == "EMISSION")
    profile.data.node_tree.links.new(nodes.new("ShaderNodeTexIES").outputs["Fac"], shader.inputs["Strength"])
    light("Shadowless", "POINT", (1, 1, 1), 0.001, use_shadow=False)


def link(obj: Any, kind: str, include: tuple[str, ...] = (), exclude: tuple[str, ...] = ()) -> Any:
    """Light linking of a light, `kind` receiver or blocker; names of collections stand for their objects."""
    chosen = bpy.data.collections.new(f"{obj.name} {kind}")
    for name in (*include, *exclude):
        if name in bpy.data.collections:
            chosen.children.link(bpy.data.collections[name])
        else:
            chosen.objects.link(bpy.data.objects[name])
    for members, ones in ((chosen.collection_objects, chosen.objects), (chosen.collection_children, chosen.children)):
        for member, one in zip(members, ones, strict=True):
            member.light_linking.link_state = "EXCLUDE" if one.name in exclude else "INCLUDE"
    setattr(obj.light_linking, f"{kind}_collection", chosen)
    return obj


def linked() -> None:
    """The room with a ball in a collection, a screen that hides from nothing, and lights that shine on some, or that some do not shadow."""
    walls()
    group = bpy.data.collections.new("Things")
    bpy.context.scene.collection.children.link(group)
    for name, low in (("Box", (1.0, 0.4, 0)), ("Tile", (1.5, 0.9, 0))):
        obj = mesh(name, corners_of(low, (low[0] + 0.35, low[1] + 0.35, 0.3)), [face[::-1] for face in FACES.values()], gray(0.8))
        bpy.context.scene.collection.objects.unlink(obj)
        group.objects.link(obj)
    mesh("Hidden", corners_of((1, 1, 1), (1.2, 1.2, 1.2)), list(FACES.values()), gray()).hide_render = True
    link(light("Things alone", "POINT", (1.0, 1.0, 1.4), 12, color=(1, 0.4, 0.2), shadow_soft_size=0.05), "receiver", ("Things", "Hidden"))
    without = light("Not the crate", "SPOT", (2.0, 0.6, 1.8), 40, color=(0.2, 0.5, 1), spot_size=1.6, shadow_soft_size=0.08)
    without.rotation_euler = (0.3, 0.2, 0)
    link(without, "receiver", exclude=("Crate",))
    link(light("No shadow of things", "POINT", (0.6, 0.5, 1.3), 8, shadow_soft_size=0), "blocker", exclude=("Things",))
    both = light("Floor by the crate", "AREA", (2.3, 0.8, 1.5), 9, color=(0.5, 1, 0.5), size=0.3)
    link(link(both, "receiver", ("Floor", "Box")), "blocker", ("Crate",))
    link(light("All", "POINT", (0.5, 1.5, 1.6), 2, shadow_soft_size=0), "receiver")
    link(light("Nothing", "POINT", (0.5, 1.5, 1.0), 50, shadow_soft_size=0), "receiver", ("Hidden",))


PHOTOMETRY = """IESNA:LM-63-2002
TILT=NONE
1 1000 1 7 5 1 2 0 0 0
1 1 10
0 15 30 45 60 90 180
0 90 180 270 360
300 260 200 120 60 10 0
300 280 150 60 20 5 0
300 150 60 20 10 5 0
300 280 150 60 20 5 0
300 260 200 120 60 10 0
"""


def by_ies(name: str, kind: str, place: tuple[float, float, float], energy: float, text: str | None, **values: Any) -> Any:
    """A light whose strength is an IES texture with a file of this text, in the .blend."""
    obj = light(name, kind, place, energy, **values)
    obj.data.use_nodes = True
    nodes, links = obj.data.node_tree.nodes, obj.data.node_tree.links
    shader = next(node for node in nodes if node.type == "EMISSION")
    node = nodes.new("ShaderNodeTexIES")
    if text is not None:
        node.ies = bpy.data.texts.new(f"{name}.ies")
        node.ies.write(text)
    links.new(node.outputs["Fac"], shader.inputs["Strength"])
    return obj


def luminaires() -> None:
    """The room under lights that IES files shape, and others whose files are not taken."""
    walls()
    by_ies("Downlight", "POINT", (1.0, 1.2, 1.6), 6, PHOTOMETRY, shadow_soft_size=0).rotation_euler = (0.5, -0.4, 0.8)
    washer = by_ies("Washer", "SPOT", (2.4, 0.6, 1.2), 8, None, shadow_soft_size=0, spot_size=2.4, spot_blend=0.2, color=(1, 0.6, 0.3))
    washer.rotation_euler = (1.1, 0.3, 2.0)
    node = next(node for node in washer.data.node_tree.nodes if node.type == "TEX_IES")
    node.mode, node.filepath = "EXTERNAL", "//washer.ies"
    node.inputs["Strength"].default_value = 1.5
    Path(sys.argv[2]).with_name("washer.ies").write_text(PHOTOMETRY)
    by_ies("Type B", "POINT", (1, 1, 1), 0.001, PHOTOMETRY.replace("7 5 1 2", "7 5 2 2"))
    by_ies("No file", "POINT", (1, 1, 1), 0.001, None)
    by_ies("Panel", "AREA", (1, 1, 1.9), 0.001, PHOTOMETRY)
    turned = by_ies("Turned", "POINT", (1, 1, 1), 0.001, PHOTOMETRY).data.node_tree
    node = next(node for node in turned.nodes if node.type == "TEX_IES")
    turned.links.new(turned.nodes.new("ShaderNodeTexCoord").outputs["Normal"], node.inputs["Vector"])
    missing = by_ies("Missing", "POINT", (1, 1, 1), 0.001, None)
    node = next(node for node in missing.data.node_tree.nodes if node.type == "TEX_IES")
    node.mode, node.filepath = "EXTERNAL", "//nowhere.ies"


def removed() -> None:
    """The room without one of its lights."""
    room()
    bpy.data.objects.remove(bpy.data.objects[ODD_NAMES[1]])


def metal() -> None:
    walls(material("Steel", "ShaderNodeBsdfAnisotropic", (0.9, 0.9, 0.9)))


def black() -> None:
    walls(material("Black", "ShaderNodeBsdfDiffuse", (0, 0, 0)))


def block() -> None:
    """A solid block and nothing else: all of its bounds is inside."""
    mesh("Floor", corners_of((0, 0, 0), (2, 2, 2)), [face[::-1] for face in FACES.values()], gray())


def plane() -> None:
    """A plane and nothing else: its bounds have no volume."""
    mesh("Floor", corners_of((0, 0, 0), (3, 3, 0)), [FACES["Floor"]], gray())


def open_air() -> None:
    """A plane with a crate on it, under no roof."""
    mesh("Floor", corners_of((0, 0, 0), (3, 3, 0)), [FACES["Floor"]], gray())
    mesh("Crate", corners_of((1, 1, 0), (2, 2, 0.8)), [face[::-1] for face in FACES.values()], gray(0.7))


def crowd() -> None:
    """The room under 100 point lights of one datablock."""
    walls()
    first = light("Star", "POINT", (0.2, 0.2, 1.8), 1.0)
    for i in range(99):
        star = bpy.data.objects.new("Star", first.data)
        star.location = (0.1 + 0.14 * (i % 20), 0.1 + 0.12 * (i // 20), 1.8)
        bpy.context.scene.collection.objects.link(star)


def cellar() -> None:
    """The room with a light, and under its floor 30 others."""
    walls()
    light("Upstairs", "POINT", (1.5, 1, 1.5), 20)
    for i in range(30):
        light(f"Cellar {i:02}", "POINT", (0.1 * i, 1, -1), 20)


def sphere() -> None:
    """A sphere of radius 1 m seen from inside, of albedo 0.5, with bounces without end."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1)
    ball = bpy.context.object
    ball.name = "Sphere"
    ball.data.flip_normals()
    ball.data.materials.append(gray())
    cycles = bpy.context.scene.cycles
    cycles.max_bounces = cycles.diffuse_bounces = 32


def white_world() -> None:
    """Two small black crates, 4 m apart, under a white world of radiance 1."""
    black_paint = material("Black", "ShaderNodeBsdfDiffuse", (0, 0, 0))
    for name, low in (("Near", -2.0), ("Far", 1.95)):
        mesh(name, corners_of((low,) * 3, (low + 0.05,) * 3), [face[::-1] for face in FACES.values()], black_paint)
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    bpy.context.scene.world = world
    bpy.context.scene.render.engine = "CYCLES"


SCENES: dict[str, Callable[[], None]] = {
    scene.__name__: scene
    for scene in (
        room,
        designed,
        linked,
        luminaires,
        unlit,
        removed,
        metal,
        black,
        block,
        plane,
        open_air,
        crowd,
        cellar,
        sphere,
        white_world,
    )
}

if __name__ == "__main__":
    from blender_bake.ipc import leave

    bpy.ops.wm.read_factory_settings(use_empty=True)
    SCENES[sys.argv[1]]()
    bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2], compress=False)
    leave(0)
