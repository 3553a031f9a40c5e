"""The scene's own lights by name: which there are, that each shines alone as designed, and that all of them sum to the scene's light."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
from bpy_process import in_blender

pytestmark = pytest.mark.blender

SIDE = 8  # texels
SAMPLES = 256
NOISE = 0.05  # of the mean irradiance: twice the noise of a texel at SAMPLES


def lit_floor(glow_strength: float = 4.0) -> Any:
    """A floor of 4 x 4 m under lights of every kind; its scene."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene

    def mesh(name: str, half: float, height: float) -> Any:
        made = bpy.data.meshes.new(name)
        corners = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
        made.from_pydata(corners, [], [(0, 1, 2, 3)] if height == 0 else [(3, 2, 1, 0)])
        layer = made.uv_layers.new(name="UV")
        for loop, uv in zip(layer.uv, [(0, 0), (1, 0), (1, 1), (0, 1)], strict=True):
            loop.vector = uv
        return made

    def add(name: str, data: Any, place: tuple[float, float, float], collection: Any = None) -> Any:
        obj = bpy.data.objects.new(name, data)
        obj.location = place
        (collection or scene.collection).objects.link(obj)
        return obj

    def material(name: str, shader: str, **values: Any) -> Any:
        made = bpy.data.materials.new(name)
        made.use_nodes = True
        made.node_tree.nodes.clear()
        node = made.node_tree.nodes.new(shader)
        node.name = "shader"
        for key, value in values.items():
            node.inputs[key.replace("_", " ")].default_value = value
        made.node_tree.links.new(node.outputs[0], made.node_tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
        return made

    floor = mesh("Floor", 2, 0)
    floor.materials.append(material("Gray", "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5, 1)))
    add("Floor", floor, (0, 0, 0))

    # Two objects of one mesh, and of one material, whose strength is driven by a light's.
    glow = material("Glow", "ShaderNodeEmission", Color=(1, 0.5, 0.2, 1))
    shared = mesh("Panel", 0.4, 1)
    shared.materials.append(glow)
    add("Panel A", shared, (-1.2, -1.2, 0.7))
    add("Panel B", shared, (1.2, 1.2, 0.7))
    # A Principled material whose emission is textured, in a node group.
    checked = material("Screen", "ShaderNodeBsdfPrincipled", Emission_Strength=3.0)
    checker = checked.node_tree.nodes.new("ShaderNodeTexChecker")
    checked.node_tree.links.new(checker.outputs["Color"], checked.node_tree.nodes["shader"].inputs["Emission Color"])
    screen = mesh("Screen", 0.5, 1)
    screen.materials.append(checked)
    screen.materials.append(glow)  # of no face: it does not emit
    add("Screen", screen, (1, -1, 0.8))
    add("Dark", mesh("Dark", 0.1, 1), (0, 0, 0.9)).data.materials.append(material("Off", "ShaderNodeEmission", Strength=0.0))

    bulb = bpy.data.lights.new("Bulb", "POINT")
    bulb.energy, bulb.shadow_soft_size = 20.0, 0.1
    add("Bulb 1", bulb, (-1, 1, 1))
    add("Bulb 2", bulb, (0.5, 0, 1))
    driver = glow.node_tree.nodes["shader"].inputs["Strength"].driver_add("default_value").driver
    driver.type, variable = "SUM", driver.variables.new()
    variable.targets[0].id_type, variable.targets[0].id, variable.targets[0].data_path = "LIGHT", bulb, "energy"
    bulb.keyframe_insert("energy", frame=1)
    bulb.energy = glow_strength
    bulb.keyframe_insert("energy", frame=11)
    sun = add("Sun", bpy.data.lights.new("Sun", "SUN"), (0, 0, 5)).data
    sun.energy, sun.use_nodes = 0.5, True
    sun.node_tree.nodes["Emission"].inputs["Color"].default_value = (0.2, 0.4, 1, 1)
    add("Unlit", bpy.data.lights.new("Unlit", "POINT"), (0, 0, 1)).data.energy = 0.0
    add("Hidden", bpy.data.lights.new("Hidden", "POINT"), (0, 0, 1)).hide_render = True

    lantern = bpy.data.collections.new("Lantern")
    spot = bpy.data.lights.new("Spot", "SPOT")
    spot.energy = 60.0
    add("Spot", spot, (0, 0, 1.5), lantern)
    tube = mesh("Tube", 0.15, 1)
    tube.materials.append(glow)
    add("Tube", tube, (0, 0, 0.5), lantern)
    for name, x in (("Lantern left", -1.5), ("Lantern right", 1.5)):
        empty = add(name, None, (x, 0, 0))
        empty.instance_type, empty.instance_collection = "COLLECTION", lantern

    world = bpy.data.worlds.new("Panel A")  # the name of an object
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.3
    scene.world = world
    group = bpy.data.collections.new("Bulbs")
    scene.collection.children.link(group)
    group.objects.link(bpy.data.objects["Bulb 1"])
    group.objects.link(bpy.data.objects["Bulb 2"])
    scene.frame_set(11)
    scene.render.engine = "CYCLES"
    scene.cycles.diffuse_bounces = 2
    return scene


class Floor:
    """Irradiance of the floor's texels, or those of another object."""

    def __init__(self, scene: Any, name: str = "Floor") -> None:
        from blender_bake import scene as scenes
        from blender_bake.lightmap import LightmapReceiver

        scenes.configure(scene)
        job = {"quantity": "irradiance", "width": SIDE, "height": SIDE, "receiver": {"object": name, "uv_layer": "UV"}}
        self._receiver = LightmapReceiver(scene, job, self)  # type: ignore[arg-type]

    def warn(self, message: str) -> None:
        """Do nothing."""

    def light(self, samples: int = SAMPLES, seed: int = 0) -> np.ndarray:
        return self._receiver.response(samples, seed)


def every_light(groups: list[str]) -> dict[str, Any]:
    from blender_bake.named_lights import NamedLights

    own = Floor(lit_floor()).light(4 * SAMPLES)
    scene = lit_floor()
    named = NamedLights(scene, groups)
    names = [entry["name"] for entry in named.entries()]
    floor = Floor(scene)
    images = []
    for seed, name in enumerate(names):
        named.aim(name)
        images.append(floor.light(seed=seed))
    named.aim(None)
    dark = floor.light(4)
    named.all_on()
    objects = [", ".join(entry["objects"]) for entry in named.entries()]
    return {"own": own, "all": floor.light(4 * SAMPLES), "dark": dark, "images": images, "names": names, "objects": objects}


def test_lights_sum_to_the_light_of_the_scene() -> None:
    found = in_blender(every_light, [])
    assert found["names"].tolist() == [
        *["Bulb 1", "Bulb 2", "Lantern left/Spot", "Lantern left/Tube", "Lantern right/Spot", "Lantern right/Tube"],
        *["Panel A", "Panel A (world)", "Panel B", "Screen", "Sun"],
    ]
    assert (found["dark"] == 0).all()
    np.testing.assert_allclose(found["all"], found["own"], rtol=1e-3)  # the same lights, in another order
    assert_sums(found)
    images = dict(zip(found["names"].tolist(), found["images"], strict=True))  # each lights its own corner; v runs up, rows down
    rows, columns = np.mgrid[:SIDE, :SIDE]
    x, y = -2 + 4 * (columns + 0.5) / SIDE, 2 - 4 * (rows + 0.5) / SIDE
    for name, place in {"Panel A": (-1.2, -1.2), "Panel B": (1.2, 1.2), "Screen": (1, -1), "Lantern left/Tube": (-1.5, 0)}.items():
        light = images[name].sum(axis=2)
        middle = np.array([(light * x).sum(), (light * y).sum()]) / light.sum()
        assert np.abs(middle - place).max() < 0.5, (name, middle)
    # The strength that the driver gave at the frame of the scene, 4: a panel's flux, of which the floor gets a bit over half.
    assert 0.4 < images["Panel A"][..., 0].mean() * 16 / (np.pi * 4 * 0.64) < 1.1


def test_a_collection_is_one_light() -> None:
    found = in_blender(every_light, ["Bulbs", "Lantern"])
    assert found["names"].tolist() == ["Bulbs", "Lantern", "Panel A", "Panel A (world)", "Panel B", "Screen", "Sun"]
    assert found["objects"][0] == "Bulb 1, Bulb 2"
    assert found["objects"][1] == "Lantern left/Spot, Lantern right/Spot, Lantern left/Tube, Lantern right/Tube"
    assert_sums(found)


def assert_sums(found: dict[str, np.ndarray]) -> None:
    """The images of the lights sum to the scene's own image."""
    own, whole = found["own"], found["images"].sum(axis=0)
    assert np.sqrt(((whole - own) ** 2).mean()) < NOISE * own.mean()
    assert abs(whole.mean() / own.mean() - 1) < 0.01


def receivers_that_emit() -> dict[str, Any]:
    """The floor under the screen alone, before and after screen and lanterns became receivers, with materials and objects of their own."""
    from blender_bake.named_lights import NamedLights
    from blender_bake.receiver_objects import prepare

    scene = lit_floor()
    named = NamedLights(scene, ["Lantern"])
    floor = Floor(scene)
    images = {}
    for when in ("before", "after"):
        for name in ("Screen", "Lantern"):
            named.aim(name)
            images[f"{name} {when}"] = floor.light()
        if when == "before":
            named.aim(None)
            Floor(scene, "Screen")
            prepare(scene, ["Lantern left"])
    named.aim(None)
    return {**images, "dark": floor.light(1)}


def test_receivers_are_switched_as_before() -> None:
    found = in_blender(receivers_that_emit)
    np.testing.assert_allclose(found["Screen after"], found["Screen before"], rtol=1e-3)
    np.testing.assert_allclose(found["Lantern after"].mean(), found["Lantern before"].mean(), rtol=0.05)  # of other samples
    assert found["Screen before"].mean() > 0.1 and (found["dark"] == 0).all()


def set_by_nodes() -> dict[str, Any]:
    """Names, and the floor's light, of objects whose emissive material geometry nodes set."""
    import bpy

    from blender_bake.named_lights import NamedLights

    scene = lit_floor()
    bpy.data.materials["Glow"].node_tree.animation_data_clear()
    group = bpy.data.node_groups.new("Paint", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    entry, end, paint = (group.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeSetMaterial"))
    paint.inputs["Material"].default_value = bpy.data.materials["Glow"]
    group.links.new(entry.outputs[0], paint.inputs[0])
    group.links.new(paint.outputs[0], end.inputs[0])
    dark = bpy.data.objects["Dark"]
    dark.modifiers.new("Paint", "NODES").node_group = group
    named = NamedLights(scene, [])
    floor = Floor(scene)
    found: dict[str, Any] = {"names": [entry["name"] for entry in named.entries()]}
    for name in ("Dark", "Panel A", None):
        named.aim(name)
        found[str(name)] = floor.light(16)
    return found


def test_materials_that_geometry_nodes_set_are_switched() -> None:
    found = in_blender(set_by_nodes)
    assert "Dark" in found["names"].tolist()
    assert found["Dark"].mean() > 0.005 and (found["None"] == 0).all()
    assert found["Panel A"].mean() > 5 * found["Dark"].mean()


def what_groups_say() -> dict[str, Any]:
    import bpy

    from blender_bake.ipc import WorkerError
    from blender_bake.named_lights import NamedLights

    said = []
    for groups in (["Bulb"], ["Empty"], ["Bulbs", "Again"]):
        scene = lit_floor()
        for name in ("Empty", "Again"):
            scene.collection.children.link(bpy.data.collections.new(name))
        bpy.data.collections["Again"].objects.link(bpy.data.objects["Bulb 2"])
        try:
            NamedLights(scene, groups)
        except WorkerError as error:
            said.append(str(error))
    named = NamedLights(lit_floor(), [])
    try:
        named.aim("Candle")
    except WorkerError as error:
        said.append(str(error))
    return {"said": said}


def test_groups_without_sense_are_refused() -> None:
    unknown, empty, twice, candle = in_blender(what_groups_say)["said"].tolist()
    assert "'Bulb'" in unknown and "'Bulbs', 'Empty', 'Lantern'" in unknown
    assert "expected a light in collection 'Empty'" in empty
    assert "'Bulb 2' in one `light_group`" in twice and "'Again' and 'Bulbs'" in twice
    assert "'Candle'" in candle and "'Bulb 1'" in candle


def many_lights(count: int) -> dict[str, Any]:
    import bpy

    from blender_bake.named_lights import NamedLights

    scene = lit_floor()
    shared, panel = bpy.data.lights["Bulb"], bpy.data.meshes["Panel"]
    for i in range(count):
        for name, data in (("Light", shared), ("Emitter", panel)):
            scene.collection.objects.link(bpy.data.objects.new(f"{name} {i}", data))
    started = time.perf_counter()
    named = NamedLights(scene, [])
    made = time.perf_counter() - started
    names = [entry["name"] for entry in named.entries()]
    named.aim(names[0])
    started = time.perf_counter()
    for name in names[:100]:
        named.aim(name)
    return {"seconds": made, "aim": (time.perf_counter() - started) / 100, "count": len(names)}


def test_thousands_of_lights_take_seconds() -> None:
    found = in_blender(many_lights, 1000)
    assert found["count"] == 2011
    assert found["seconds"] < 30 and found["aim"] < 0.02, found  # 2 s and 0.3 ms on two idle cores
