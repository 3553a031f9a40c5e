"""The lobe that a material writes: what of its nodes Cycles takes, and what it leaves out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from bpy_process import in_blender
from test_glossy_bakes import receiver_of

pytestmark = pytest.mark.blender

METAL, PLASTIC = (0.2, 1.0, 1.0), (0.08 * 0.6, 0.08, 0.08)  # weight x roughness, weight with a Fresnel term, weight


def lobes_of_muted_nodes() -> dict[str, Any]:
    """Sums over the lobes of a mix of rough plastic and smooth metal, with nodes and links of it muted."""
    import bpy

    from blender_bake import lobes

    def lobe(change: Any) -> np.ndarray:
        material = bpy.data.materials.new("Mixed")
        material.use_nodes = True
        tree = material.node_tree
        nodes, links = tree.nodes, tree.links
        nodes.clear()
        plastic, metal = nodes.new("ShaderNodeBsdfPrincipled"), nodes.new("ShaderNodeBsdfPrincipled")
        plastic.inputs["Roughness"].default_value = 0.6
        metal.inputs["Roughness"].default_value, metal.inputs["Metallic"].default_value = 0.2, 1.0
        mix, output = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeOutputMaterial")
        mix.inputs[0].default_value = 1.0
        links.new(plastic.outputs[0], mix.inputs[1])
        links.new(metal.outputs[0], mix.inputs[2])
        links.new(mix.outputs[0], output.inputs["Surface"])
        change(tree, mix, metal)
        return np.array(lobes.of_surface(tree, output.inputs["Surface"]).parts, float)

    def mute_mix(tree: Any, mix: Any, metal: Any) -> None:
        mix.mute = True

    def mute_share(tree: Any, mix: Any, metal: Any) -> None:
        value = tree.nodes.new("ShaderNodeValue")
        tree.links.new(value.outputs[0], mix.inputs[0]).is_muted = True

    def mute_metal(tree: Any, mix: Any, metal: Any) -> None:
        metal.mute = True

    return {
        "as_is": lobe(lambda tree, mix, metal: None),
        "mix": lobe(mute_mix),
        "share": lobe(mute_share),
        "metal": lobe(mute_metal),
    }


def test_muted_nodes_and_links_are_left_out_as_cycles_leaves_them_out() -> None:
    found = in_blender(lobes_of_muted_nodes)
    np.testing.assert_allclose(found["as_is"], METAL, rtol=1e-6)
    np.testing.assert_allclose(found["mix"], PLASTIC, rtol=1e-6)
    np.testing.assert_allclose(found["share"], METAL, rtol=1e-6)
    np.testing.assert_array_equal(found["metal"], 0)


def lobe_of_large_values() -> dict[str, Any]:
    """The lobe of a plane of that mix whose factor, metallic and roughness are fed by numbers above 1."""
    import bpy

    from blender_bake import scene as scenes

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scenes.configure(bpy.context.scene)
    bpy.ops.mesh.primitive_plane_add(size=2)
    material = bpy.data.materials.new("Mixed")
    material.use_nodes = True
    bpy.context.object.data.materials.append(material)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    plastic, metal, mix = nodes["Principled BSDF"], nodes.new("ShaderNodeBsdfPrincipled"), nodes.new("ShaderNodeMixShader")
    number = nodes.new("ShaderNodeValue")
    number.outputs[0].default_value = 1.7
    for socket in (mix.inputs[0], metal.inputs["Metallic"], metal.inputs["Roughness"]):
        links.new(number.outputs[0], socket)
    links.new(plastic.outputs[0], mix.inputs[1])
    links.new(metal.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], nodes["Material Output"].inputs["Surface"])
    return receiver_of(bpy.context.scene, "Plane", []).channels(["lobe"])


def test_numbers_above_1_are_cut_off_as_cycles_cuts_them_off() -> None:
    lobe = in_blender(lobe_of_large_values)["lobe"].reshape(-1, 3)[:4]
    np.testing.assert_allclose(lobe, 1, atol=1e-3)  # roughness, share with a Fresnel term, whether there is any: metal alone
