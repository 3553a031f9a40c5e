"""Fragments of the surfaces: their size, sides, and albedo of textures in every kind of coordinates."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
from bpy_process import in_blender

pytestmark = pytest.mark.blender


class Silent:
    """Keeps warnings."""

    def __init__(self) -> None:
        self.said: list[str] = []

    def warn(self, message: str) -> None:
        self.said.append(message)


def new_scene() -> Any:
    import bpy

    from blender_bake import scene as scenes

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scenes.configure(bpy.context.scene)
    return bpy.context.scene


def mesh_of(name: str, corners: Any, faces: Any, material: Any = None) -> Any:
    import bpy

    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, corner)) for corner in corners], [], faces)
    if material is not None:
        mesh.materials.append(material)
    return mesh


def add(name: str, data: Any, place: Any = (0, 0, 0), scale: Any = (1, 1, 1), turn: float = 0.0, collection: Any = None) -> Any:
    import bpy

    obj = bpy.data.objects.new(name, data)
    obj.location, obj.scale, obj.rotation_euler = place, scale, (0, 0, turn)
    (collection or bpy.context.scene.collection).objects.link(obj)
    return obj


def colored_by(node: str, output: str, **settings: Any) -> Any:
    """A diffuse material whose color is an output of a node, x, y, z as red, green, blue."""
    import bpy

    material = bpy.data.materials.new(node)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    source, diffuse = nodes.new(node), nodes.new("ShaderNodeBsdfDiffuse")
    for key, value in settings.items():
        setattr(source, key, value)
    links.new(source.outputs[output], diffuse.inputs["Color"])
    links.new(diffuse.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


SIZE = np.array([2.0, 1.0])  # m, of a sheet from (0, 0) to (2, 1) in its own frame
SHEET = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)]


def textures() -> dict[str, Any]:
    """Fragments of turned and scaled sheets, by the kind of coordinates that color them, back in the sheet's own frame."""
    import bpy

    from blender_bake import surfaces

    scene = new_scene()
    materials = {
        "generated": colored_by("ShaderNodeTexCoord", "Generated"),
        "object": colored_by("ShaderNodeTexCoord", "Object"),
        "uv": colored_by("ShaderNodeTexCoord", "UV"),
        "second uv": colored_by("ShaderNodeUVMap", "UV", uv_map="Second"),
        "color": colored_by("ShaderNodeVertexColor", "Color", layer_name="Painted"),
        "attribute": colored_by("ShaderNodeAttribute", "Vector", attribute_name="Own"),
    }
    objects = {}
    for i, (name, material) in enumerate(materials.items()):
        mesh = mesh_of(name, SHEET, [(0, 1, 2, 3)], material)
        ramp = [(0, 0), (1, 0), (1, 1), (0, 1)]
        for layer, scale in (("First", 1.0), ("Second", 0.5)):
            made = mesh.uv_layers.new(name=layer, do_init=False)
            for loop, uv in zip(made.uv, ramp, strict=True):
                loop.vector = (scale * uv[0], scale * uv[1])
        painted = mesh.color_attributes.new("Painted", "FLOAT_COLOR", "POINT")
        own = mesh.attributes.new("Own", "FLOAT_VECTOR", "POINT")
        for k, (x, y) in enumerate(ramp):
            painted.data[k].color = (0.5 * x, 0.25 * y, 0.125, 1)
            own.data[k].vector = (0.25 * x, 0.5 * y, 0.75)
        objects[name] = add(name, mesh, (0, 3 * i, 0), (0.4, 0.7, 1), 0.3 * i)
    bpy.context.view_layer.update()
    inverse = {name: np.linalg.inv(np.array(obj.matrix_world)) for name, obj in objects.items()}
    found = surfaces.fragments(scene, 0.08, Silent())  # type: ignore[arg-type]
    out = {}
    for i, name in enumerate(found["names"]):
        mine = found["object"] == i
        back = inverse[name]
        out[f"{name} places"] = found["corners"][mine].mean(axis=1) @ back[:3, :3].T + back[:3, 3]
        out[f"{name} albedo"] = found["albedo"][mine]
    return out


def test_albedo_of_textures_in_every_kind_of_coordinates() -> None:
    found = in_blender(textures)
    scales = {"generated": (1, 1, 0), "uv": (1, 1, 0), "second uv": (0.5, 0.5, 0), "color": (0.5, 0.25, 0), "attribute": (0.25, 0.5, 0)}
    constants = {"color": 0.125, "attribute": 0.75}
    for name, (x, y, _) in scales.items():
        unit = found[f"{name} places"][:, :2] / SIZE
        expected = np.stack([x * unit[:, 0], y * unit[:, 1], np.full(len(unit), constants.get(name, 0))], axis=1)
        if name == "generated":
            expected[:, 2] = found["generated albedo"][0, 2]  # of a flat sheet
        np.testing.assert_allclose(found[f"{name} albedo"], expected, atol=0.01, err_msg=name)
    np.testing.assert_allclose(found["object albedo"][:, :2], np.clip(found["object places"][:, :2], 0, 1), atol=0.02)


CUBE = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
OUTWARDS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def cubes() -> dict[str, Any]:
    """Cubes of several materials, one of them mirrored, one shown by empties; a sheet that diffuse rays do not see."""
    import bpy

    from blender_bake import materials, surfaces

    scene = new_scene()
    metal, glass = bpy.data.materials.new("Metal"), bpy.data.materials.new("Glass")
    for material, key in ((metal, "Metallic"), (glass, "Transmission Weight")):
        material.use_nodes = True
        material.node_tree.nodes["Principled BSDF"].inputs[key].default_value = 1.0
    pane = colored_by("ShaderNodeRGB", "Color")
    clear = pane.node_tree.nodes.new("ShaderNodeBsdfTransparent")
    pane.node_tree.links.new(clear.outputs[0], pane.node_tree.get_output_node("CYCLES").inputs["Surface"])
    kinds = {"red": materials.lambert((0.6, 0.1, 0.05)), "none": None, "metal": metal, "glass": glass, "pane": pane}
    for i, (name, material) in enumerate(kinds.items()):
        add(name, mesh_of(name, CUBE, OUTWARDS, material), (4 * i, 0, 0))
    add("mirrored", bpy.data.meshes["red"], (0, 4, 0), (-1, 1, 1))
    hidden = bpy.data.collections.new("Shown")
    add("inside", bpy.data.meshes["red"], collection=hidden)
    for i in range(2):
        empty = add(f"empty {i}", None, (4 * i, 8, 0), (1, 1 - 2 * i, 1))
        empty.instance_type, empty.instance_collection = "COLLECTION", hidden
    add("unseen", mesh_of("unseen", SHEET, [(0, 1, 2, 3)])).visible_diffuse = False
    add("disabled", mesh_of("disabled", SHEET, [(0, 1, 2, 3)])).hide_render = True
    area = surfaces.area(scene)
    found = surfaces.fragments(scene, 0.5, Silent())  # type: ignore[arg-type]
    return {**found, "area": area}


def test_sides_albedo_and_names() -> None:
    found = in_blender(cubes)
    names = found["names"].tolist()
    assert sorted(names) == ["empty 0", "empty 1", "glass", "metal", "mirrored", "none", "pane", "red"]
    corners = found["corners"].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    assert edges.max() <= 0.5 + 1e-6 and found["longest"] == 0.5
    np.testing.assert_allclose(np.linalg.norm(cross, axis=1).sum() / 2, 8 * 24, rtol=1e-5)
    np.testing.assert_allclose(found["area"], 8 * 24, rtol=1e-5)
    albedo = {"metal": (0, 0, 0), "glass": (0, 0, 0), "pane": (0, 0, 0), "none": (0.8, 0.8, 0.8)}
    for i, name in enumerate(names):
        mine = found["object"] == i
        middle = corners[mine].mean(axis=(0, 1))
        outward = ((corners[mine].mean(axis=1) - middle) * cross[mine]).sum(axis=1)
        assert (outward > 0).all(), name
        np.testing.assert_allclose(found["albedo"][mine].mean(axis=0), albedo.get(name, (0.6, 0.1, 0.05)), atol=1e-3, err_msg=name)
        assert (found["transparent"][mine] == (name == "pane")).all()
    assert (found["transmission"] == 0).all()
    assert found["occluders"].shape == (7 * 12 + 2, 3, 3)  # undivided; the pane casts no shadow, the unseen sheet does


def glowing() -> dict[str, Any]:
    """Sheets that emit: a ramp along x, 5 times (1, 0.5, 0) on one side, and a strength of 0; a plain one."""
    import bpy

    from blender_bake import materials, surfaces

    scene = new_scene()
    made = {}
    for name, strength in (("ramp", 4.0), ("front", 5.0), ("off", 0.0)):
        material = made[name] = bpy.data.materials.new(name)
        material.use_nodes = True
        nodes, links = material.node_tree.nodes, material.node_tree.links
        nodes.clear()
        emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
        emission.inputs["Color"].default_value = (1, 0.5, 0, 1)
        emission.inputs["Strength"].default_value = strength
        shader = emission.outputs[0]
        if name == "ramp":
            links.new(nodes.new("ShaderNodeTexCoord").outputs["Generated"], emission.inputs["Color"])
        if name == "front":
            mix = nodes.new("ShaderNodeMixShader")
            links.new(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], mix.inputs[0])
            links.new(shader, mix.inputs[1])
            shader = mix.outputs[0]
        links.new(shader, output.inputs["Surface"])
    made["plain"] = materials.lambert((0.6, 0.1, 0.05))
    for i, (name, material) in enumerate(made.items()):
        add(name, mesh_of(name, SHEET, [(0, 1, 2, 3)], material), (0, 2 * i, 0))
    bpy.context.view_layer.update()
    return surfaces.fragments(scene, 0.5, Silent())  # type: ignore[arg-type]


def test_emission_of_textures_strengths_and_sides() -> None:
    found = in_blender(glowing)
    of = {name: found["object"] == i for i, name in enumerate(found["names"].tolist())}
    places = found["corners"][of["ramp"]].mean(axis=1)
    np.testing.assert_allclose(found["emission"][of["ramp"]][:, :2], 4 * places[:, :2] / SIZE, atol=0.02)
    np.testing.assert_allclose(found["emission"][of["front"]], np.broadcast_to([5.0, 2.5, 0.0], (of["front"].sum(), 3)), rtol=1e-3)
    assert not found["emission"][of["off"] | of["plain"]].any()
    np.testing.assert_array_equal(found["one_sided"].astype(bool), of["front"])


def large() -> dict[str, Any]:
    """A scene of a square kilometer, and a dense one of 43,000 triangles with a texture."""
    import bpy

    from blender_bake import surfaces

    scene = new_scene()
    add("ground", mesh_of("ground", SHEET, [(0, 1, 2, 3)]), scale=(500, 1000, 1))
    events = Silent()
    ground = surfaces.fragments(scene, 0.1, events)  # type: ignore[arg-type]
    scene = new_scene()
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=147, y_subdivisions=147, size=10)
    bpy.context.object.data.materials.append(colored_by("ShaderNodeTexNoise", "Color"))
    started = time.perf_counter()
    dense = surfaces.fragments(scene, 0.05, events)  # type: ignore[arg-type]
    seconds = time.perf_counter() - started
    return {
        "ground": len(ground["corners"]),
        "longest": ground["longest"],
        "said": events.said,
        "dense": len(dense["corners"]),
        "seconds": seconds,
    }


def cloth() -> dict[str, Any]:
    """A square of cloth that reflects 0.4 and lets 0.3 through, its color linked; and whether the link is there afterwards."""
    import bpy

    from blender_bake import surfaces

    scene = new_scene()
    material = bpy.data.materials.new("Cloth")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    diffuse, through = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeBsdfTranslucent")
    diffuse.inputs["Color"].default_value = (0.4, 0.4, 0.4, 1)
    color = nodes.new("ShaderNodeRGB")
    color.outputs[0].default_value = (0.3, 0.3, 0.3, 1)
    links.new(color.outputs[0], through.inputs["Color"])
    both, output = nodes.new("ShaderNodeAddShader"), nodes.new("ShaderNodeOutputMaterial")
    links.new(diffuse.outputs[0], both.inputs[0])
    links.new(through.outputs[0], both.inputs[1])
    links.new(both.outputs[0], output.inputs["Surface"])
    add("Curtain", mesh_of("Curtain", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)], material))
    found = surfaces.fragments(scene, 1.0, Silent())  # type: ignore[arg-type]
    return {"albedo": found["albedo"], "transmission": found["transmission"], "linked": np.array(len(through.inputs["Color"].links))}


def test_light_that_cloth_lets_through_is_not_reflected() -> None:
    found = in_blender(cloth)
    np.testing.assert_allclose(found["albedo"], 0.4, atol=2e-3)
    np.testing.assert_allclose(found["transmission"], 0.3, atol=2e-3)
    assert found["linked"] == 1


def test_large_scenes_are_divided_less() -> None:
    found = in_blender(large)
    assert 50_000 < found["ground"] <= 400_000 and 2 < found["longest"] < 10
    assert len(found["said"]) == 1 and "in place of 0.1 m" in found["said"][0]
    assert found["dense"] > 80_000 and found["seconds"] < 20, found  # about a second on two idle cores


def test_nothing_to_divide_is_said() -> None:
    assert "expected objects that render" in str(in_blender(nothing)["said"])


def nothing() -> dict[str, Any]:
    from blender_bake import surfaces
    from blender_bake.ipc import WorkerError

    try:
        surfaces.fragments(new_scene(), 0.1, Silent())  # type: ignore[arg-type]
    except WorkerError as error:
        return {"said": str(error)}
    return {"said": ""}


def test_a_needle_is_divided_along_its_length() -> None:
    found = in_blender(thin)
    edges = np.linalg.norm(np.roll(found["corners"], -1, axis=1) - found["corners"], axis=2)
    assert edges.max() <= 0.1 and len(found["corners"]) < 3000  # 10 m by 0.02 m: squares would be 10,000


def thin() -> dict[str, Any]:
    from blender_bake.surfaces import split

    corners = np.array([[[0, 0, 0], [10, 0, 0], [10, 0.02, 0]]], np.float64)
    parents, weights = split(corners, 0.1)
    np.testing.assert_allclose(weights.sum(axis=2), 1)
    return {"corners": np.einsum("fij,fjk->fik", weights, corners[parents])}
