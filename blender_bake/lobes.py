# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape of the specular lobe of every material as a shader output (AOV), made of the material's own nodes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

AOV = "srbf_lobe"  # (weight x roughness, weight x share with a Fresnel term, weight)
DIELECTRIC = 0.08  # weight of the lobe of a Principled surface that is no metal, beside 1 of a metal
FRESNEL = {"ShaderNodeBsdfPrincipled", "ShaderNodeBsdfMetallic"}
PLAIN = {"ShaderNodeBsdfAnisotropic", "ShaderNodeBsdfGlossy"}
OUTPUTS = ("srbf lobe roughness", "srbf lobe fresnel", "srbf lobe weight")  # of node groups
Value = Any  # a socket or a float


@dataclass(frozen=True)
class Lobe:
    """Sums over the specular lobes of a shader: weight x roughness, weight x (1 with a Fresnel term, else 0), and weight."""

    roughness: Value = 0.0
    fresnel: Value = 0.0
    weight: Value = 0.0

    @property
    def parts(self) -> tuple[Value, Value, Value]:
        return self.roughness, self.fresnel, self.weight


def add(layer: bpy.types.ViewLayer) -> None:
    """Make every material write AOV, and the layer have it as a pass; materials without nodes or gloss write 0."""
    made = layer.aovs.add()
    made.name, made.type = AOV, "COLOR"
    for tree, _, color in _colors(bpy.data.materials):
        if color is None:
            continue
        shown = tree.nodes.new("ShaderNodeOutputAOV")
        shown.aov_name = AOV
        tree.links.new(color, shown.inputs["Color"])


@contextmanager
def emitted(materials: Iterable[bpy.types.Material]) -> Iterator[None]:
    """Inside, materials with nodes emit what AOV would hold, and reflect nothing; those without gloss emit 0."""
    before = []
    for tree, surface, color in _colors(dict.fromkeys(materials)):
        before.append((tree, surface, surface.links[0].from_socket if surface.links else None))
        shown = tree.nodes.new("ShaderNodeEmission")
        shown.inputs["Color"].default_value = (0, 0, 0, 1)
        if color is not None:
            tree.links.new(color, shown.inputs["Color"])
        tree.links.new(shown.outputs[0], surface)
    try:
        yield
    finally:
        for tree, surface, source in before:
            tree.nodes.remove(surface.links[0].from_node)
            if source is not None:
                tree.links.new(source, surface)


def of_sums(sums: np.ndarray) -> np.ndarray:
    """(roughness, share of the lobe with a Fresnel term, 1 where there is any) of AOV, whose last axis is (.., .., weight)."""
    weight = sums[..., 2:]
    return np.where(weight > 0, sums / np.where(weight > 0, weight, 1), 0).astype(np.float32)


def _colors(
    materials: Iterable[bpy.types.Material],
) -> Iterator[tuple[bpy.types.NodeTree, bpy.types.NodeSocket, bpy.types.NodeSocket | None]]:
    """(node tree, the input that shows its surface, a socket of its `Lobe`, None without gloss) of every material with nodes in use."""
    groups: dict[str, Lobe] = {}
    for material in materials:
        tree = material.node_tree if material is not None and material.use_nodes and material.users else None
        output = tree.get_output_node("CYCLES") if tree is not None else None
        if tree is None or output is None:
            continue
        found = of_surface(tree, output.inputs["Surface"], groups)
        if found.weight == 0.0:
            yield tree, output.inputs["Surface"], None
            continue
        color = tree.nodes.new("ShaderNodeCombineXYZ")
        for target, value in zip(color.inputs, found.parts, strict=True):
            _put(tree, value, target)
        yield tree, output.inputs["Surface"], color.outputs[0]


def is_layered(material: bpy.types.Material | None) -> bool:
    """Whether all gloss of a material is that of Principled surfaces, which lies over their diffuse reflection."""
    kinds = set() if material is None or not material.use_nodes else set(_kinds(material.node_tree))
    return bool(kinds & FRESNEL) and not kinds & PLAIN


def _kinds(tree: bpy.types.NodeTree | None) -> Iterator[str]:
    for node in () if tree is None else tree.nodes:
        yield from _kinds(node.node_tree) if node.type == "GROUP" else (node.bl_idname,)


def remove(layer: bpy.types.ViewLayer) -> None:
    """Take the pass off again; the nodes stay, which write nothing then."""
    found = next((aov for aov in layer.aovs if aov.name == AOV), None)
    if found is not None:
        layer.aovs.remove(found)


def _feeding(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """The output that feeds an input; nothing where its link is muted."""
    return next((link.from_socket for link in socket.links if link.is_valid and not link.is_muted), None)


def of_surface(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket, groups: dict[str, Lobe] | None = None) -> Lobe:
    """The sums of the shader that feeds an input, numbers or outputs of the tree; `groups`: of node groups, kept for all their users."""
    groups = {} if groups is None else groups
    shader = _feeding(socket)
    return Lobe() if shader is None else _of_shader(tree, shader, groups)


def _of_shader(tree: bpy.types.NodeTree, shader: bpy.types.NodeSocket, groups: dict[str, Lobe]) -> Lobe:
    """Of the shader that a socket puts out."""
    node = shader.node
    kind = node.bl_idname
    if node.mute:
        through = next((way.from_socket for way in node.internal_links if way.to_socket == shader), None)
        return Lobe() if through is None else of_surface(tree, through, groups)
    if kind == "NodeReroute":
        return of_surface(tree, node.inputs[0], groups)
    if kind == "ShaderNodeMixShader":
        one, other = (of_surface(tree, node.inputs[i], groups) for i in (1, 2))
        share = _share(tree, node.inputs[0])
        rest = _math(tree, "SUBTRACT", 1.0, share)
        pairs = zip(one.parts, other.parts, strict=True)
        return Lobe(*(_math(tree, "ADD", _math(tree, "MULTIPLY", rest, a), _math(tree, "MULTIPLY", share, b)) for a, b in pairs))
    if kind == "ShaderNodeAddShader":
        one, other = (of_surface(tree, socket, groups) for socket in node.inputs)
        return Lobe(*(_math(tree, "ADD", a, b) for a, b in zip(one.parts, other.parts, strict=True)))
    if kind == "ShaderNodeGroup" and node.node_tree is not None:
        return _of_group(node, shader, groups)
    if kind not in FRESNEL | PLAIN:
        return Lobe()
    weight: Value = 1.0
    if "Metallic" in node.inputs:
        weight = _math(tree, "ADD", DIELECTRIC, _math(tree, "MULTIPLY", 1 - DIELECTRIC, _share(tree, node.inputs["Metallic"])))
    return Lobe(_math(tree, "MULTIPLY", weight, _share(tree, node.inputs["Roughness"])), weight if kind in FRESNEL else 0.0, weight)


def _of_group(node: bpy.types.Node, shader: bpy.types.NodeSocket, groups: dict[str, Lobe]) -> Lobe:
    """Through further outputs of the group: what is inside is made once for all its users."""
    inner, key = node.node_tree, f"{node.node_tree.name_full}\n{shader.identifier}"
    names = [f"{name} {shader.identifier}" for name in OUTPUTS]
    if key not in groups:
        output = inner.get_output_node("CYCLES") if hasattr(inner, "get_output_node") else None
        if output is None or not output.bl_idname.endswith("GroupOutput"):
            output = next((one for one in inner.nodes if one.bl_idname == "NodeGroupOutput" and one.is_active_output), None)
        source = None if output is None else next((one for one in output.inputs if one.identifier == shader.identifier), None)
        groups[key] = Lobe() if source is None else of_surface(inner, source, groups)
        if groups[key].weight != 0.0:
            assert output is not None
            for name, value in zip(names, groups[key].parts, strict=True):
                made = inner.interface.new_socket(name, in_out="OUTPUT", socket_type="NodeSocketFloat")
                _put(inner, value, next(one for one in output.inputs if one.identifier == made.identifier))
    return Lobe() if groups[key].weight == 0.0 else Lobe(*(node.outputs[name] for name in names))


def _share(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket) -> Value:
    """What an input holds, 0 to 1, as Cycles takes it."""
    feeding = _feeding(socket)
    if feeding is None:
        return min(max(float(socket.default_value), 0.0), 1.0)
    within = tree.nodes.new("ShaderNodeClamp")
    tree.links.new(feeding, within.inputs["Value"])
    return within.outputs[0]


def _put(tree: bpy.types.NodeTree, value: Value, socket: bpy.types.NodeSocket) -> None:
    if isinstance(value, float):
        socket.default_value = value
    else:
        tree.links.new(value, socket)


def _math(tree: bpy.types.NodeTree, operation: str, a: Value, b: Value) -> Value:
    """A math node; a number where both are numbers, or one is a 0 or 1 that settles it."""
    if isinstance(a, float) and isinstance(b, float):
        return {"ADD": a + b, "SUBTRACT": a - b, "MULTIPLY": a * b}[operation]
    if operation == "MULTIPLY" and 0.0 in (a, b):
        return 0.0
    made = tree.nodes.new("ShaderNodeMath")
    made.operation = operation
    for value, socket in ((a, made.inputs[0]), (b, made.inputs[1])):
        _put(tree, value, socket)
    return made.outputs[0]
