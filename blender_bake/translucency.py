# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that shadow rays pass: each can be switched to walls of a transmittance by angle, whose shadows an engine can cast."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager

import bpy
import numpy as np

Curve = list[tuple[float, float, float]]  # transmittance of one wall, at KNOTS cosines from 0 to 1
KNOTS = 8
CLEAR: Curve = [(1.0, 1.0, 1.0)] * KNOTS
FINE = 4  # ramp stops between two knots of a probe
GAUSS_NEWTON = 12
MOST_TEXELS = 1 << 17  # of a material under a light, that its curve is fitted to
SMOOTH = 1e-3  # weight of a curve's second differences
BRIGHTEST = 8.0  # a wall may concentrate light, up to this


class Translucent:
    """A material with a switch: off, it is unchanged; on, shadow rays are multiplied by a transmittance that depends on their angle."""

    def __init__(self, material: bpy.types.Material) -> None:
        tree = material.node_tree
        surface = tree.get_output_node("CYCLES").inputs["Surface"]
        self.name = material.name
        facing = tree.nodes.new("ShaderNodeLayerWeight")
        facing.inputs["Blend"].default_value = 0.5
        cosine = tree.nodes.new("ShaderNodeMath")
        cosine.operation = "SUBTRACT"
        cosine.inputs[0].default_value = 1.0
        tree.links.new(facing.outputs["Facing"], cosine.inputs[1])
        self._ramp = tree.nodes.new("ShaderNodeValToRGB")
        tree.links.new(cosine.outputs[0], self._ramp.inputs[0])
        clear = tree.nodes.new("ShaderNodeBsdfTransparent")
        tree.links.new(self._ramp.outputs["Color"], clear.inputs["Color"])
        self._switch = tree.nodes.new("ShaderNodeMath")
        self._switch.operation = "MULTIPLY"
        tree.links.new(tree.nodes.new("ShaderNodeLightPath").outputs["Is Shadow Ray"], self._switch.inputs[0])
        mix = tree.nodes.new("ShaderNodeMixShader")
        tree.links.new(self._switch.outputs[0], mix.inputs[0])
        tree.links.new(surface.links[0].from_socket, mix.inputs[1])
        tree.links.new(clear.outputs[0], mix.inputs[2])
        tree.links.new(mix.outputs[0], surface)
        self.off()

    def on(self, curve: Curve) -> None:
        """Switch to the transmittance `curve` of one wall, linear between even steps of the cosine of incidence."""
        stops = self._ramp.color_ramp.elements
        while len(stops) > 1:
            stops.remove(stops[-1])
        for i, color in enumerate(curve):
            stop = stops[0] if i == 0 else stops.new(i / (len(curve) - 1))
            stop.position = i / (len(curve) - 1)
            stop.color = (*color, 1)
        self._switch.inputs[1].default_value = 1.0

    def off(self) -> None:
        """The material of the scene."""
        self._switch.inputs[1].default_value = 0.0


class Switch:
    """All translucent materials of a scene; false where there is none."""

    def __init__(self, translucent: list[Translucent], transmittances: Mapping[str, Curve]) -> None:
        self._translucent = translucent
        self._transmittances = transmittances

    def __bool__(self) -> bool:
        return bool(self._translucent)

    def on(self) -> None:
        """Switch all to their transmittances."""
        for one in self._translucent:
            one.on(self._transmittances[one.name])

    def off(self) -> None:
        """The materials of the scene."""
        for one in self._translucent:
            one.off()


@contextmanager
def switched(switch: Switch | None) -> Iterator[None]:
    """The translucent materials, if any, switched on inside."""
    if switch is not None:
        switch.on()
    yield
    if switch is not None:
        switch.off()


def find(scene: bpy.types.Scene) -> list[Translucent]:
    """The scene's materials that let shadow rays through, in order of name, each given a switch."""
    return [Translucent(material) for material in passing(scene)]


def passing(scene: bpy.types.Scene) -> list[bpy.types.Material]:
    """The scene's materials that let shadow rays through, in order of name."""
    used = {slot.material for obj in scene.objects if not obj.hide_render for slot in obj.material_slots if slot.material}
    used |= {m for mesh in bpy.data.meshes for m in mesh.materials if m}  # of instances
    return [m for m in sorted(used, key=lambda m: m.name) if m.use_nodes and m.node_tree and _passes(m)]


def cut_out(scene: bpy.types.Scene) -> list[str]:
    """Names of materials whose transparency depends on a texture or an attribute, such as leaves on cards: their outline is lost."""
    return [material.name for material in passing(scene) if _varies(material.node_tree)]


def fit_transmittances(
    translucent: list[Translucent], aims: Iterable[Callable[[], None]], direct: Callable[[], np.ndarray]
) -> dict[str, Curve]:
    """The transmittance of each material that reproduces the direct light behind it best, in least squares; by name.

    Fitted with every other such material clear, under each light that `aims` turn on: a texel whose light d passed walls at the cosines c
    gets d prod m(c). With ln m = sum_k theta_k hat_k(c) that is d exp(sum_k theta_k F_k), where F_k = sum over walls of hat_k(c) is
    read off a bake whose walls have the transmittance 2^-hat_k.
    """
    found: dict[str, list[tuple[np.ndarray, ...]]] = {one.name: [] for one in translucent}
    for aim in aims if translucent else ():
        aim()
        for one in translucent:
            one.on(CLEAR)
        clear = direct()
        for one in translucent:
            features = []
            for first in range(0, KNOTS, 3):
                one.on(_probe(first))
                features.append(direct())
            one.off()
            true = direct()
            one.on(CLEAR)
            lit = (clear > 0).all(axis=2)
            for image in features:
                lit &= (image > 0).all(axis=2)
            stacked = np.concatenate([np.log2(clear[lit] / image[lit]) for image in features], axis=1)[:, :KNOTS]
            met = np.flatnonzero(stacked.sum(axis=1) > 0.5)
            met = met[:: -(-len(met) // MOST_TEXELS) or 1]
            found[one.name].append((stacked[met], clear[lit][met], true[lit][met]))
    for one in translucent:
        one.off()
    return {name: _curve(*map(np.concatenate, zip(*parts, strict=True))) if parts else CLEAR for name, parts in found.items()}


def _probe(first: int) -> Curve:
    """2^-hat of knots first, first + 1, first + 2 in red, green and blue."""
    place = np.arange((KNOTS - 1) * FINE + 1) / FINE
    hats = np.maximum(0, 1 - np.abs(place[:, None] - (first + np.arange(3))))
    return [(float(r), float(g), float(b)) for r, g, b in 2.0**-hats]


def _curve(walls: np.ndarray, whole: np.ndarray, passed: np.ndarray) -> Curve:
    """Gauss-Newton per color, from the constant that fits best; second differences are damped where no light constrains them."""
    if not len(walls):
        return CLEAR
    bends = np.diff(np.eye(KNOTS), 2, axis=0)
    curve = np.ones((KNOTS, 3))
    for channel in range(3):
        d, t = whole[:, channel].astype(np.float64), passed[:, channel].astype(np.float64)
        n = walls.sum(axis=1, dtype=np.float64)
        constants = np.linspace(0.01, 1, 100)
        errors = [float(((t - d * m**n) ** 2).sum()) for m in constants]
        theta = np.full(KNOTS, np.log(constants[int(np.argmin(errors))]))
        for _ in range(GAUSS_NEWTON):
            model = d * np.exp(walls @ theta)
            slope = model[:, None] * walls
            weight = SMOOTH * float((model * model).sum())
            left = slope.T @ slope + weight * (bends.T @ bends)
            right = slope.T @ (t - model) - weight * (bends.T @ (bends @ theta))
            theta = np.clip(theta + np.linalg.solve(left + 1e-9 * np.trace(left) * np.eye(KNOTS), right), np.log(1e-3), np.log(BRIGHTEST))
        curve[:, channel] = np.exp(theta)
    return [(float(r), float(g), float(b)) for r, g, b in np.round(curve, 5)]


def _passes(material: bpy.types.Material) -> bool:
    output = material.node_tree.get_output_node("CYCLES")
    return output is not None and bool(output.inputs["Surface"].links) and _lets_through(material.node_tree)


def _lets_through(tree: bpy.types.NodeTree) -> bool:
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeBsdfTransparent" and any(output.links for output in node.outputs):
            return True
        if node.bl_idname == "ShaderNodeBsdfPrincipled" and (node.inputs["Alpha"].links or node.inputs["Alpha"].default_value < 1):
            return True
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree and _lets_through(node.node_tree):
            return True
    return False


def _varies(tree: bpy.types.NodeTree) -> bool:
    for node in tree.nodes:
        inputs = []
        if node.bl_idname == "ShaderNodeBsdfTransparent" and any(output.links for output in node.outputs):
            inputs = [node.inputs["Color"]]
        elif node.bl_idname == "ShaderNodeBsdfPrincipled":
            inputs = [node.inputs["Alpha"]]
        elif node.bl_idname == "ShaderNodeMixShader" and any(_is_transparent(socket) for socket in node.inputs[1:]):
            inputs = [node.inputs[0]]
        elif node.bl_idname == "ShaderNodeGroup" and node.node_tree and _lets_through(node.node_tree):
            inputs = list(node.inputs)
            if _varies(node.node_tree):
                return True
        if any(_is_textured(socket) for socket in inputs):
            return True
    return False


def _is_transparent(socket: bpy.types.NodeSocket) -> bool:
    return any(link.from_node.bl_idname == "ShaderNodeBsdfTransparent" for link in socket.links)


def _is_textured(socket: bpy.types.NodeSocket) -> bool:
    """Whether a texture or an attribute of the mesh feeds a socket."""
    waiting, seen = [link.from_node for link in socket.links], set()
    while waiting:
        node = waiting.pop()
        if node.name in seen:
            continue
        seen.add(node.name)
        kind = node.bl_idname
        if (kind.startswith("ShaderNodeTex") and kind != "ShaderNodeTexCoord") or kind in {"ShaderNodeAttribute", "ShaderNodeVertexColor"}:
            return True
        if kind == "ShaderNodeGroup" and node.node_tree and any(n.bl_idname.startswith("ShaderNodeTex") for n in node.node_tree.nodes):
            return True
        waiting += [link.from_node for each in node.inputs for link in each.links]
    return False
