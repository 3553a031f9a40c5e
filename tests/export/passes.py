"""Passes of translated shaders, one after the other: programs of HLSL through SPIR-V, textures and targets of floats.

And what the passes of Unity and Unreal share: sides of targets, axes of shadow maps, a light as a pass looks at it, sums of powers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np
from pixels import corner_shader, shared_context

from srbf.export import spirv
from srbf.gl.uniforms import NO_CONE, versine
from srbf.lights import DirectionalLight, Light, PointLight, SpotLight

PART = 64  # entries of a table that one texel adds up


def doublings(terms: int) -> list[bool]:
    """How a sum of so many powers is made of the first: a step doubles the terms where true, and adds one where false."""
    return [*doublings(terms // 2), True, *([False] if terms % 2 else [])] if terms > 1 else []


def summed(product: Callable[[Any, Any, Any], Any], exchange: Any, one: Any, terms: int) -> Any:
    """The sum of so many powers of `exchange`, as the engines draw it; `product`: left right + addend, None: nothing added."""
    total, power = one, exchange
    for doubling in doublings(terms):
        left = power if doubling else exchange
        total, power = product(left, total, total if doubling else one), product(left, power, None)
    return total


@dataclass(frozen=True)
class Look:
    """A light in the asset's frame, less the middle of the cells: `place` is the direction to a distant one."""

    distant: bool
    place: tuple[float, ...]
    color: tuple[float, ...]
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)
    shape: tuple[float, ...] = (1.0, 1e-4, *NO_CONE)  # a0, radius (m), 1 - cos of a spot's half-angles
    squared: bool = True

    @staticmethod
    def of(light: Light, middle: np.ndarray) -> Look:
        if isinstance(light, DirectionalLight):
            return Look(True, light.direction, light.color)
        assert isinstance(light, PointLight)
        place, squared = tuple(np.array(light.position) - middle), light.falloff == "inverse-square"
        cone, axis = NO_CONE, (0.0, 0.0, 1.0)
        if isinstance(light, SpotLight):
            cone, axis = (versine(light.inner), versine(light.outer)), light.direction
        return Look(False, place, light.color, axis, (light.a0, light.radius, *cone), squared)


def face_axes(face: int) -> list[np.ndarray]:
    """Columns, rows and the way that a face of a cube looks."""
    axes = np.roll(np.eye(3), -(face // 2) - 1, axis=0)
    return [axes[0], axes[1], axes[2] * (1 - 2 * (face % 2))]


def frame_of(toward: np.ndarray) -> list[np.ndarray]:
    """Columns and rows of a distant light's map, and the way to the light."""
    across = np.cross([0, 0, 1] if abs(toward[2]) < 0.9 else [1, 0, 0], toward)
    across /= np.linalg.norm(across)
    return [across, np.cross(toward, across), toward]


def square(count: int) -> tuple[int, int]:
    """(width, height) of a texture of so many texels."""
    width = max(1, math.ceil(math.sqrt(count)))
    return width, -(-count // width)


class Passes:
    """Draws in the context that all pictures share; everything made is released at the end of the `with`."""

    def __enter__(self) -> Passes:
        self._made = ExitStack()
        self._context = shared_context()
        self._made.enter_context(self._context)
        return self

    def __exit__(self, *_: object) -> None:
        self._made.close()

    def kept(self, resource: Any) -> Any:
        self._made.callback(resource.release)
        return resource

    def program(self, fragment: str, entry: str, vertex: str | None = None) -> Any:
        """Of HLSL: a fragment entry, and a vertex entry of the same text; without, a triangle over the whole target."""
        shaders = [spirv.cross_compile(spirv.compile_hlsl(fragment, "frag", entry), "glsl")]
        shaders.append(corner_shader() if vertex is None else spirv.cross_compile(spirv.compile_hlsl(fragment, "vert", vertex), "glsl"))
        if vertex is not None:  # names of what passes between them are each compiler's own
            shaders = [_renamed(shaders[0], "in"), _renamed(shaders[1], "out")]
        return self.kept(self._context.program(fragment_shader=shaders[0], vertex_shader=shaders[1]))

    def texture(self, values: np.ndarray) -> Any:
        pixels = np.ascontiguousarray(np.atleast_3d(values), np.float32)
        if pixels.ndim == 4:
            made = self._context.texture_array((pixels.shape[2], pixels.shape[1], len(pixels)), pixels.shape[3], pixels, dtype="f4")
        else:
            made = self._context.texture((pixels.shape[1], pixels.shape[0]), pixels.shape[2], pixels, dtype="f4")
        made.filter = (self._context.NEAREST, self._context.NEAREST)
        return self.kept(made)

    def target(self, width: int, height: int, channels: int = 4) -> Any:
        return self.texture(np.zeros((height, width, channels)))

    def column(self, numbers: np.ndarray) -> Any:
        """One RGB texel in each row."""
        return self.texture(np.pad(numbers[:, None], ((0, 0), (0, 0), (0, 1))))

    def identity(self, rank: int) -> Any:
        return self.texture(np.repeat(np.eye(rank)[..., None], 4, axis=2))

    def draw(
        self,
        program: Any,
        target: Any,
        images: dict[str, Any],
        uniforms: dict[str, Any],
        vertices: int = 3,
        blend: str | None = None,
    ) -> None:
        """Into a texture of floats."""
        context = self._context
        samplers = [name for name in program if "Combined" in name or name in images]
        for unit, sampler in enumerate(samplers):
            name = next(name for name in sorted(images, key=len, reverse=True) if name in sampler)
            images[name].use(unit)
            program[sampler].value = unit
        for name, value in uniforms.items():
            for member in (member for member in program if member == name or member.endswith(f".{name}")):
                program[member].write(np.ascontiguousarray(value, np.float32))
        framebuffer = self.kept(context.framebuffer([target]))
        framebuffer.use()
        context.enable_only(context.NOTHING if blend is None else context.BLEND)
        context.blend_func = context.ONE, context.ONE
        context.blend_equation = context.MAX if blend == "max" else context.FUNC_ADD
        if "corner" in program:
            corners = self.kept(context.buffer(np.array([[-1, -1], [3, -1], [-1, 3]], np.float32)))
            triangle = self.kept(context.vertex_array(program, [(corners, "2f", "corner")]))
        else:
            triangle = self.kept(context.vertex_array(program, []))
        triangle.render(vertices=vertices)
        context.enable_only(context.NOTHING)

    @staticmethod
    def read(target: Any) -> np.ndarray:
        width, height = target.size
        return np.frombuffer(target.read(), np.float32).reshape(height, width, -1).copy()


def _renamed(text: str, side: str) -> str:
    """The one number that a vertex hands to its pixels, under one name."""
    found = re.search(rf"^(?:layout\(location = 0\) )?{side} float (\w+);", text, re.MULTILINE)
    return re.sub(rf"\b{found[1]}\b", "passedOn", text) if found else text
