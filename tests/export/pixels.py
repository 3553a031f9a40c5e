"""Shaders that came through SPIR-V, run by moderngl over one triangle, and the bounds that their pixels keep."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from functools import cache
from typing import Any

import numpy as np

from srbf import methods
from srbf.asset import Asset
from srbf.basis.octahedral_table import lookup
from srbf.export import spirv
from srbf.gl.context import create_context
from srbf.gl.textures import AssetTextures, Limits
from srbf.gl.uniforms import padded, point_light_uniforms
from srbf.light_geometry import attenuation, light_vectors
from srbf.lights import DirectionalLight, Light, PointLight, SpotLight
from srbf.methods.coefficient_maps import components_of, first_function
from srbf.methods.relighting_map import basis_weights

FLOAT = 1e-5  # the contract, of the sum of the terms' magnitudes

LIGHTS: dict[str, Light] = {
    "directional": DirectionalLight((0.3, 0.5, 0.8), (1.0, 0.8, 0.3)),
    "point": PointLight((0.4, -0.2, 1.1), (1.0, 0.5, 2.0), a0=0.7),
    "inverse-square": PointLight((0.4, -0.2, 0.3), (1.0, 0.5, 2.0), a0=0.7, falloff="inverse-square", radius=0.5),
    "spot": SpotLight((0.4, -0.3, 1.1), (0.5, 1.0, 2.0), a0=0.8, direction=(0.1, 0.2, -1.0), inner=0.3, outer=0.6),
}

ALL = list(LIGHTS.values())


@cache
def shared_context() -> Any:
    """One context for all pictures of a process."""
    return create_context()


@cache
def corner_shader() -> str:
    return spirv.cross_compile(spirv.compile_stage("fullscreen.vert", {}), "glsl")


def weights_of(asset: Asset, lights: Sequence[Light]) -> np.ndarray:
    """What the shaders take: (K, 4) of relighting maps, (C, S + 1, 4) of coefficient maps, float32."""
    weights = padded(methods.projected_weights(asset, lights).astype(np.float32))
    return weights if asset.method == "relighting-map" else weights.reshape(asset.clusters, asset.components + 1, 4)


def magnitude(asset: Asset, light: Light) -> np.ndarray:
    """The sum of the magnitudes of a picture's terms, decoding included, (H, W, 3): what the tolerance is relative to."""
    bias = asset.bias[:, None, None]
    layers = np.abs(asset.coefficients() - bias) + np.abs(bias)  # (N, H, W, C)
    point_light = isinstance(light, PointLight)
    color = np.broadcast_to(np.array(light.color), (asset.height, asset.width, 3))
    if isinstance(light, PointLight):
        unit, _ = light_vectors(light, asset.images["position"])
        reach = attenuation(np.linalg.norm(np.array(light.position) - asset.images["position"], axis=-1), light)
        color = color * reach[..., None]  # without the cone, whose own rounding is relative to 1
    if asset.method == "relighting-map":
        if point_light:
            return np.einsum("khwc,hwk->hwc", layers, basis_weights(asset, unit)) * color
        return np.einsum("khwc,kc->hwc", layers, np.abs(methods.projected_weights(asset, [light])))
    first, entry = first_function(asset, slice(None)), asset.manifest["w_table"]
    table = np.abs(asset.tables["w_table"].astype(np.float32))
    weights = np.abs(methods.projected_weights(asset, [light]))

    def function(j: int) -> np.ndarray:
        return lookup(table, entry["size"], entry["columns"], first + j, unit) * color if point_light else weights[first + j]

    planes = components_of(layers, asset.components)
    return function(0) + sum(plane[..., None] * function(j) for j, plane in enumerate(planes, start=1))


def run(fragment: str, asset: Asset, images: dict[str, np.ndarray], uniforms: dict[str, Any]) -> np.ndarray:
    """A GLSL 3.30 fragment shader of spirv-cross over the asset's texels, (H, W, 4): `images` and `uniforms` by the names that they had."""
    context = shared_context()
    with context, ExitStack() as made:
        program = context.program(vertex_shader=corner_shader(), fragment_shader=fragment)
        made.callback(program.release)
        textures = AssetTextures(context, asset, Limits.of(context), made)
        own = {"layers": textures.layers}
        for unit, sampler in enumerate(name for name in program if "Combined" in name or name in images or name in own):
            wanted = next(name for name in sorted([*images, *own], key=len, reverse=True) if name.lower() in sampler.lower())
            if wanted in own:
                texture = own[wanted]()
            else:
                pixels = np.ascontiguousarray(np.atleast_3d(images[wanted]), np.float32)
                texture = context.texture((pixels.shape[1], pixels.shape[0]), pixels.shape[2], pixels, dtype="f4")
                made.callback(texture.release)
            texture.filter = (context.NEAREST, context.NEAREST)
            texture.use(unit)
            program[sampler].value = unit
        for name, value in uniforms.items():
            for member in (member for member in program if member == name or member.endswith(f".{name}")):
                if isinstance(value, np.ndarray):
                    program[member].write(np.ascontiguousarray(value))
                else:
                    program[member].value = value
        pixels = context.texture((asset.width, asset.height), 4, dtype="f4")
        target = context.framebuffer([pixels])
        corners = context.buffer(np.array([[-1, -1], [3, -1], [-1, 3]], np.float32))
        triangle = context.vertex_array(program, [(corners, "2f", "corner")])
        for resource in (pixels, target, corners, triangle):
            made.callback(resource.release)
        target.use()
        context.enable_only(context.NOTHING)
        triangle.render(vertices=3)
        return np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(asset.height, asset.width, 4).copy()


def images_of(asset: Asset) -> dict[str, np.ndarray]:
    """Every texture but the layers, by the names of `srbfAssetPoint`."""
    images = {"positions": asset.images["position"]}
    images["table"] = asset.table[None, :, None] if asset.method == "relighting-map" else asset.tables["w_table"]
    if "cluster_index" in asset.tables:
        images["clusters"] = asset.tables["cluster_index"][..., None] / 255
    return images


def point_light_members(light: PointLight) -> dict[str, Any]:
    return {f"pointLight.{name}": value for name, value in point_light_uniforms(light).items()}
