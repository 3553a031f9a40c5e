# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes whose receiver carries, or stands under, what a bake may lose: `python left_behind.py NAME OUT.blend`.

`python left_behind.py bake IN.blend OBJECT OUT.npy X,Y,Z…` is Blender's own bake of the file as it is, under a sun from each direction.
"""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))

from closed_form_scenes import SQUARE, camera, material, quad  # noqa: E402

SIDE = 32
SAMPLES = 64


def ground():
    """The white square that light is read from."""
    return quad("Ground")


def ball(name, radius=0.4, location=(0, 0, 0.6), color=(0.1, 0.1, 0.1)):
    """A black ball."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=radius, location=location)
    obj = bpy.context.object
    obj.name = name
    obj.data.materials.append(material(name, color))
    return obj


def aside(name, radius=0.15):
    """A ball that is shown only where something scatters it."""
    obj = ball(name, radius, (50, 0, 0))
    obj.data.transform(__import__("mathutils").Matrix.Translation((0, 0, 0.3)))
    return obj


def hair_system(obj, count=400, length=0.5, kind="HAIR", **settings):
    """Particle hair, or particles, on an object; their material is its second slot."""
    obj.modifiers.new("Particles", "PARTICLE_SYSTEM")
    found = obj.particle_systems[0].settings
    found.type = kind
    found.count = count
    if kind == "HAIR":
        found.hair_length = length
        found.root_radius, found.tip_radius, found.radius_scale = 1.0, 1.0, 0.02
        obj.data.materials.append(material("hair", (0.05, 0.03, 0.02)))
        found.material = 2
    for name, value in settings.items():
        setattr(found, name, value)
    return found


def geometry_nodes(obj, build):
    """A geometry-nodes modifier; `build(group, geometry in)` returns the socket that goes out."""
    group = bpy.data.node_groups.new("nodes", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    entry, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    group.links.new(build(group, entry.outputs[0]), end.inputs[0])
    obj.modifiers.new("Nodes", "NODES").node_group = group
    return group


def joined(group, *sockets):
    join = group.nodes.new("GeometryNodeJoinGeometry")
    for socket in sockets:
        group.links.new(socket, join.inputs[0])
    return join.outputs[0]


def node(group, kind, inputs=None, **properties):
    made = group.nodes.new(kind)
    for name, value in properties.items():
        setattr(made, name, value)
    for name, value in (inputs or {}).items():
        if isinstance(value, bpy.types.NodeSocket):
            group.links.new(value, made.inputs[name])
        else:
            made.inputs[name].default_value = value
    return made


def instances(group, source, points=None):
    """Instances of an object on a few points above the square."""
    info = node(group, "GeometryNodeObjectInfo", {"Object": source})
    if points is None:
        points = node(group, "GeometryNodeMeshGrid", {"Size X": 1.2, "Size Y": 1.2, "Vertices X": 3, "Vertices Y": 3}).outputs["Mesh"]
    return node(group, "GeometryNodeInstanceOnPoints", {"Points": points, "Instance": info.outputs["Geometry"]}).outputs["Instances"]


def hair():
    """Particle hair on the receiver."""
    hair_system(ground())


def hair_and_children():
    """Few parents, many children that only a render shows."""
    obj = ground()
    hair_system(obj, 40, child_type="SIMPLE", child_percent=0, rendered_child_count=20, child_radius=0.2)


def hair_elsewhere():
    """Hair of another object over the receiver."""
    ground()
    other = quad("Other", [(x * 0.6, y * 0.6, 0.8) for x, y, _ in SQUARE], location=(0, 0, 0))
    hair_system(other, 100, 0.3)


def hair_hidden_emitter():
    """Hair whose emitter does not render, on its own, over the receiver."""
    hair_elsewhere()
    bpy.data.objects["Other"].show_instancer_for_render = False


def particle_objects():
    """Balls as particles of the receiver."""
    source = aside("Ball")
    hair_system(
        ground(), 40, kind="HAIR", render_type="OBJECT", instance_object=source, particle_size=1.0, use_advanced_hair=True, hair_length=1
    )


def particle_halves():
    """Particles of which the viewport shows a tenth."""
    particle_objects()
    bpy.data.particles[0].display_percentage = 10


def particle_collection():
    """A collection as particles of the receiver."""
    source = aside("Ball")
    held = bpy.data.collections.new("Held")
    held.objects.link(source)
    hair_system(ground(), 40, render_type="COLLECTION", instance_collection=held, particle_size=1.0, use_advanced_hair=True, hair_length=1)


def emitted():
    """Emitted particles, those of the first frame, shown as balls."""
    source = aside("Ball", 0.3)
    hair_system(
        ground(),
        120,
        kind="EMITTER",
        render_type="OBJECT",
        instance_object=source,
        particle_size=1.0,
        frame_start=1,
        frame_end=5,
        lifetime=50,
    )
    bpy.context.scene.frame_set(1)


def node_instances():
    """Geometry nodes of the receiver that scatter instances above it."""
    source = aside("Ball")
    geometry_nodes(ground(), lambda group, geometry: joined(group, geometry, instances(group, source)))


def nested_instances():
    """Instances of instances."""
    source = aside("Ball", 0.1)
    inner = ball("Inner", 0.05, (60, 0, 0))
    geometry_nodes(inner, lambda group, geometry: instances(group, source))
    inner.scale = (0.4, 0.4, 1)
    geometry_nodes(ground(), lambda group, geometry: joined(group, geometry, instances(group, inner)))


def node_curves():
    """Hair made by geometry nodes of the receiver: curves beside its mesh."""
    obj = ground()

    def build(group, geometry):
        line = node(group, "GeometryNodeCurvePrimitiveLine", {"Start": (0, 0, 0), "End": (0, 0, 0.5)})
        points = node(group, "GeometryNodeDistributePointsOnFaces", {"Mesh": geometry, "Density": 60.0}).outputs["Points"]
        on = node(group, "GeometryNodeInstanceOnPoints", {"Points": points, "Instance": line.outputs[0]})
        real = node(group, "GeometryNodeRealizeInstances", {"Geometry": on.outputs["Instances"]})
        thick = node(group, "GeometryNodeSetCurveRadius", {"Curve": real.outputs[0], "Radius": 0.02})
        return joined(group, geometry, thick.outputs[0])

    geometry_nodes(obj, build)


def node_points():
    """A point cloud made by geometry nodes of the receiver."""
    obj = ground()

    def build(group, geometry):
        points = node(group, "GeometryNodeDistributePointsOnFaces", {"Mesh": geometry, "Density": 30.0}).outputs["Points"]
        up = node(group, "GeometryNodeSetPosition", {"Geometry": points, "Offset": (0, 0, 0.4)})
        thick = node(group, "GeometryNodeSetPointRadius", {"Points": up.outputs[0], "Radius": 0.08})
        return joined(group, geometry, thick.outputs[0])

    geometry_nodes(obj, build)


def fog_material(density=2.0):
    made = bpy.data.materials.new("fog")
    made.use_nodes = True
    made.node_tree.nodes.clear()
    scatter = made.node_tree.nodes.new("ShaderNodeVolumePrincipled")
    scatter.inputs["Density"].default_value = density
    made.node_tree.links.new(scatter.outputs[0], made.node_tree.nodes.new("ShaderNodeOutputMaterial").inputs["Volume"])
    return made


def node_volume():
    """A volume made by geometry nodes of the receiver."""
    obj = ground()
    obj.data.materials.append(fog_material(8.0))

    def build(group, geometry):
        cube = node(group, "GeometryNodeVolumeCube", {"Density": 1.0, "Min": (-0.6, -0.6, 0.2), "Max": (0.6, 0.6, 0.8)})
        dyed = node(group, "GeometryNodeSetMaterial", {"Geometry": cube.outputs[0], "Material": obj.data.materials[1]})
        return joined(group, geometry, dyed.outputs[0])

    geometry_nodes(obj, build)


def node_curves_and_instances():
    """Hair curves and instances beside the mesh."""
    source = aside("Ball")
    obj = ground()

    def build(group, geometry):
        line = node(group, "GeometryNodeCurvePrimitiveLine", {"Start": (0.4, 0.4, 0), "End": (0.4, 0.4, 0.9)})
        thick = node(group, "GeometryNodeSetCurveRadius", {"Curve": line.outputs[0], "Radius": 0.1})
        return joined(group, geometry, thick.outputs[0], instances(group, source))

    geometry_nodes(obj, build)


def only_instances():
    """A receiver that is nothing but instances: a wall of blocks."""
    obj = ground()
    block = quad("Block", [(x * 0.25, y * 0.25, 0) for x, y, _ in SQUARE], location=(50, 0, 0))
    geometry_nodes(obj, lambda group, geometry: instances(group, block))
    ball("Ball", 0.2, (0, 0, 0.6))


def fog_box():
    """A box of fog over the receiver: a mesh with a volume material."""
    ground()
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 0.7))
    bpy.context.object.data.materials.append(fog_material())


def volume_object():
    """A Volume object, made by a modifier of a mesh."""
    ground()
    source = ball("Source", 0.5, (0, 0, 0.7))
    source.hide_render = True
    data = bpy.data.volumes.new("Cloud")
    obj = bpy.data.objects.new("Cloud", data)
    bpy.context.scene.collection.objects.link(obj)
    data.materials.append(fog_material(20.0))
    modifier = obj.modifiers.new("Volume", "MESH_TO_VOLUME")
    modifier.object = source
    modifier.resolution_mode = "VOXEL_AMOUNT"
    modifier.voxel_amount = 24


def curves_object():
    """A Curves object, as the hair tools make it, over the receiver."""
    ground()
    data = bpy.data.hair_curves.new("Curves")
    obj = bpy.data.objects.new("Curves", data)
    bpy.context.scene.collection.objects.link(obj)
    data.add_curves([2] * 60)
    rng = np.random.default_rng(1)
    roots = rng.uniform(-0.8, 0.8, (60, 2))
    points = np.array([(x, y, z) for x, y in roots for z in (0.1, 0.7)], np.float32)
    data.position_data.foreach_set("vector", points.ravel())
    radius = data.attributes.get("radius") or data.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.full(120, 0.02, np.float32))
    data.materials.append(material("curves", (0.1, 0.1, 0.1)))


def point_cloud():
    """A point-cloud object over the receiver, made by nodes of an object elsewhere."""
    ground()
    host = quad("Host", [(x * 0.6, y * 0.6, 0.6) for x, y, _ in SQUARE])

    def build(group, geometry):
        points = node(group, "GeometryNodeDistributePointsOnFaces", {"Mesh": geometry, "Density": 30.0}).outputs["Points"]
        return node(group, "GeometryNodeSetPointRadius", {"Points": points, "Radius": 0.08}).outputs[0]

    geometry_nodes(host, build)


def metaballs():
    """Metaballs over the receiver."""
    ground()
    data = bpy.data.metaballs.new("Meta")
    obj = bpy.data.objects.new("Meta", data)
    bpy.context.scene.collection.objects.link(obj)
    data.elements.new().co = (0.2, 0, 0.7)
    data.elements.new().co = (-0.3, 0.2, 0.7)
    for element in data.elements:
        element.radius = 0.5
    data.resolution, data.render_resolution = 0.4, 0.1
    data.materials.append(material("meta", (0.1, 0.1, 0.1)))


def text_and_curve():
    """A text and a beveled curve over the receiver."""
    ground()
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.extrude, text.size = "SRBF", 0.05, 0.7
    obj = bpy.data.objects.new("Text", text)
    obj.location = (-0.8, 0, 0.4)
    bpy.context.scene.collection.objects.link(obj)
    data = bpy.data.curves.new("Curve", "CURVE")
    data.dimensions, data.bevel_depth = "3D", 0.05
    spline = data.splines.new("POLY")
    spline.points.add(1)
    spline.points[0].co, spline.points[1].co = (-0.8, -0.5, 0.3, 1), (0.8, -0.5, 0.6, 1)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Curve", data))


def node_instances_and_follower():
    """Instances scattered by the receiver, which another object reads: a lid that geometry nodes make of the receiver's own mesh."""
    node_instances()
    follower = quad("Follower", [(x, y, 5) for x, y, _ in SQUARE], color=(0, 0, 0))

    def build(group, _geometry):
        taken = node(group, "GeometryNodeObjectInfo", {"Object": bpy.data.objects["Ground"]}).outputs["Geometry"]
        meshes = node(group, "GeometryNodeSeparateComponents", {"Geometry": taken}).outputs["Mesh"]
        return node(group, "GeometryNodeTransform", {"Geometry": meshes, "Translation": (1.2, 0, 0.8)}).outputs[0]

    geometry_nodes(follower, build)


def hair_and_node_instances():
    """Hair beside instances."""
    node_instances()
    hair_system(bpy.data.objects["Ground"], 200, 0.4)


def hair_and_node_points():
    """Hair beside a point cloud."""
    node_points()
    hair_system(bpy.data.objects["Ground"], 200, 0.4)


def culled():
    """Simplify that culls what the camera does not see: a lid behind it."""
    ground()
    lid = quad("Lid", [(x, y, 1.5) for x, y, _ in SQUARE], color=(0, 0, 0), location=(0, 0.5, 0))
    obj = camera(location=(0, 0, 1.4))
    obj.rotation_euler = (0, 0, 0)
    scene = bpy.context.scene
    scene.render.use_simplify = True
    scene.cycles.use_camera_cull = lid.cycles.use_camera_cull = True
    scene.cycles.camera_cull_margin = 0.0


def face_instances():
    """A parent whose children stand on its faces."""
    ground()
    parent = quad("Parent", [(x * 0.5, y * 0.5, 0.5) for x, y, _ in SQUARE])
    child = ball("Child", 0.3, (0, 0, 0))
    child.parent = parent
    parent.instance_type = "FACES"
    parent.show_instancer_for_render = False


def receiver_instances_on_faces():
    """The same, the parent being the receiver."""
    obj = ground()
    child = ball("Child", 0.3, (0, 0, 0.6))
    child.parent = obj
    obj.instance_type = "FACES"


def vertex_instances():
    """Children on the receiver's vertices."""
    obj = ground()
    child = ball("Child", 0.3, (0.5, 0, 0.6))
    child.parent = obj
    obj.instance_type = "VERTS"


def collection_instance():
    """An instanced collection over the receiver."""
    ground()
    held = bpy.data.collections.new("Held")
    source = aside("Ball", 0.4)
    bpy.context.scene.collection.objects.unlink(source)
    held.objects.link(source)
    source.location = (0, 0, 0.3)
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", held
    bpy.context.scene.collection.objects.link(empty)


def render_only_modifiers():
    """Modifiers that only the render, and that only the viewport shows."""
    obj = ground()
    cutter = ball("Cutter", 0.5, (0, 0, 0))
    cutter.hide_render = True
    cut = obj.modifiers.new("Boolean", "BOOLEAN")
    cut.object, cut.show_viewport, cut.show_render = cutter, False, True
    wide = obj.modifiers.new("Array", "ARRAY")
    wide.show_viewport, wide.show_render = True, False


def render_steps():
    """A screw whose render has more steps."""
    ground()
    mesh = bpy.data.meshes.new("Profile")
    mesh.from_pydata([(0.5, 0, 0.3), (0.3, 0, 0.7)], [(0, 1)], [])
    obj = bpy.data.objects.new("Profile", mesh)
    bpy.context.scene.collection.objects.link(obj)
    screw = obj.modifiers.new("Screw", "SCREW")
    screw.steps, screw.render_steps = 3, 32


def screwed_receiver():
    """The receiver itself of a screw whose render has more steps."""
    mesh = bpy.data.meshes.new("Ground")
    mesh.from_pydata([(0.2, 0, 0), (1, 0, 0)], [(0, 1)], [])
    obj = bpy.data.objects.new("Ground", mesh)
    bpy.context.scene.collection.objects.link(obj)
    screw = obj.modifiers.new("Screw", "SCREW")
    screw.steps, screw.render_steps, screw.use_stretch_u, screw.use_stretch_v = 3, 32, True, True
    mesh.materials.append(material("Ground"))


def simplified():
    """Simplify: the viewport divides nothing, the render twice."""
    obj = ground()
    lift = ball("Lift", 0.5, (0, 0, 0.6))
    for one in (obj, lift):
        modifier = one.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels = modifier.render_levels = 2
        modifier.boundary_smooth = "PRESERVE_CORNERS"
    render = bpy.context.scene.render
    render.use_simplify = True
    render.simplify_subdivision, render.simplify_subdivision_render = 0, 2


def viewport_node():
    """Geometry nodes that leave the square empty of its cover in the viewport."""
    source = aside("Ball")

    def build(group, geometry):
        seen = node(group, "GeometryNodeIsViewport")
        switch = node(group, "GeometryNodeSwitch")
        group.links.new(seen.outputs[0], switch.inputs["Switch"])
        group.links.new(instances(group, source), switch.inputs["False"])
        return joined(group, geometry, switch.outputs[0])

    geometry_nodes(ground(), build)


def linked_lights():
    """Light and shadow linking of the scene's own sun, which a bake replaces, and of the objects."""
    ground()
    block = ball("Ball")
    data = bpy.data.lights.new("Sun", "SUN")
    sun = bpy.data.objects.new("Sun", data)
    bpy.context.scene.collection.objects.link(sun)
    for purpose in ("receiver_collection", "blocker_collection"):
        held = bpy.data.collections.new(purpose)
        held.objects.link(block)
        setattr(sun.light_linking, purpose, held)


def indirect_only():
    """A collection that is indirect only, with a red wall."""
    ground()
    wall = quad("Wall", [(-0.5, -0.5, 0.1), (-0.5, 0.5, 0.1), (-0.5, 0.5, 0.8), (-0.5, -0.5, 0.8)], color=(0.9, 0.1, 0.1))
    held = bpy.data.collections.new("Held")
    bpy.context.scene.collection.children.link(held)
    bpy.context.scene.collection.objects.unlink(wall)
    held.objects.link(wall)
    bpy.context.view_layer.layer_collection.children["Held"].indirect_only = True


def holdout_occluder():
    """A ball that is a holdout, over the receiver."""
    ground()
    ball("Ball").is_holdout = True


def shadow_catcher_occluder():
    """A ball that is a shadow catcher, over the receiver."""
    ground()
    ball("Ball").is_shadow_catcher = True


def caught():
    """The receiver itself a shadow catcher, under a ball."""
    ground().is_shadow_catcher = True
    ball("Ball")


def held_out():
    """The receiver itself a holdout."""
    ground().is_holdout = True
    ball("Ball")


def collected(**settings):
    """The receiver in a collection of its own, with settings of the view layer's."""
    obj = ground()
    ball("Ball")
    held = bpy.data.collections.new("Held")
    bpy.context.scene.collection.children.link(held)
    bpy.context.scene.collection.objects.unlink(obj)
    held.objects.link(obj)
    for name, value in settings.items():
        setattr(bpy.context.view_layer.layer_collection.children["Held"], name, value)


def held_out_by_collection():
    """The receiver in a collection that the view layer holds out."""
    collected(holdout=True)


def seen_indirectly():
    """The receiver in a collection that is indirect only."""
    collected(indirect_only=True)


def held_out_by_material():
    """A receiver whose material is a Holdout."""
    obj = ground()
    obj.data.materials[0] = material_of("ShaderNodeHoldout")
    ball("Ball")


def half_held_out():
    """A receiver of two faces, one of them with a Holdout material."""
    obj = ground()
    obj.data.materials.append(material_of("ShaderNodeHoldout"))
    bpy.context.view_layer.objects.active = obj
    modifier = obj.modifiers.new("Divide", "SUBSURF")
    modifier.subdivision_type = "SIMPLE"
    bpy.ops.object.modifier_apply(modifier=modifier.name)
    obj.data.polygons[0].material_index = 1


def material_of(shader):
    made = bpy.data.materials.new(shader)
    made.use_nodes = True
    made.node_tree.nodes.clear()
    node = made.node_tree.nodes.new(shader)
    made.node_tree.links.new(node.outputs[0], made.node_tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def unseen_by_rays():
    """A receiver that no kind of ray sees, under a ball."""
    obj = ground()
    ball("Ball")
    for ray in ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
        setattr(obj, f"visible_{ray}", False)


def grease_pencil():
    """Strokes, which Cycles does not see."""
    ground()
    bpy.ops.object.grease_pencil_add(type="STROKE", location=(0, 0, 0.5))


def lattice():
    """The receiver bent by a lattice, an empty and a lattice beside it."""
    obj = ground()
    data = bpy.data.lattices.new("Lattice")
    cage = bpy.data.objects.new("Lattice", data)
    cage.scale = (3, 3, 1)
    bpy.context.scene.collection.objects.link(cage)
    for point in list(data.points)[:2]:
        point.co_deform.z += 0.6
    obj.modifiers.new("Lattice", "LATTICE").object = cage
    ball("Ball", 0.3)


SCENES = {
    name: made
    for name, made in list(globals().items())
    if callable(made)
    and getattr(made, "__module__", None) == __name__
    and made.__code__.co_argcount == 0
    and name not in ("main", "ground")
}


def own_bake(blend, name, out, directions):
    """(suns, SIDE, SIDE, 3) irradiance of an object under each sun: Blender's own bake of the file as it is."""
    bpy.ops.wm.open_mainfile(filepath=blend)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.use_light_tree = SAMPLES, False, False
    scene.cycles.sample_clamp_indirect = 0
    for point_light in [one for one in scene.objects if one.type == "LIGHT"]:
        bpy.data.objects.remove(point_light)
    if scene.world is not None:
        scene.world = None
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.data.angle = 1.0, 0.0
    scene.collection.objects.link(sun)
    image = bpy.data.images.new("bake", SIDE, SIDE, alpha=True, float_buffer=True)
    obj = scene.objects[name]
    for slot in obj.material_slots:
        target = slot.material.node_tree.nodes.new("ShaderNodeTexImage")
        target.image = image
        slot.material.node_tree.nodes.active = target
    for other in scene.objects:
        other.select_set(other == obj)
    bpy.context.view_layer.objects.active = obj
    images = []
    for direction in directions:
        sun.rotation_euler = Vector(direction).to_track_quat("Z", "Y").to_euler()
        bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, margin=0, use_clear=True)
        pixels = np.empty(SIDE * SIDE * 4, np.float32)
        image.pixels.foreach_get(pixels)
        images.append(pixels.reshape(SIDE, SIDE, 4)[::-1, :, :3] * math.pi)
    np.save(out, np.stack(images))


if __name__ == "__main__":
    if sys.argv[1] == "bake":
        own_bake(*sys.argv[2:5], [tuple(map(float, word.split(","))) for word in sys.argv[5:]])
    else:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        SCENES[sys.argv[1]]()
        if bpy.context.scene.camera is None:
            camera()
        bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2], check_existing=False)
    os._exit(0)
