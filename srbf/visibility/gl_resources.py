"""OpenGL resources of one owner, released together, and drawing with uniforms by name."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.gl.context import compile_program
from srbf.gl.includes import resolve
from srbf.light_profile import Profile

if TYPE_CHECKING:
    import moderngl

Target = tuple["moderngl.Texture", "moderngl.Framebuffer"]


class Resources:
    """What is made on a context that somebody else releases; `close` while the context is current."""

    def __init__(self, context: moderngl.Context) -> None:
        self.context = context
        self._made = ExitStack()

    def close(self) -> None:
        """Release all."""
        self._made.close()

    def program(self, vertex: str, fragment: str) -> moderngl.Program:
        """Of two stages of `glsl/stages`."""
        return self._kept(compile_program(self.context, resolve(f"stages/{vertex}"), resolve(f"stages/{fragment}")))

    def buffer(self, content: ndarray) -> moderngl.Buffer:
        """A vertex buffer."""
        return self._kept(self.context.buffer(np.ascontiguousarray(content, np.float32)))

    def array(self, program: moderngl.Program, buffer: moderngl.Buffer, *layout: str) -> moderngl.VertexArray:
        """Vertices of a buffer as a program takes them."""
        return self._kept(self.context.vertex_array(program, [(buffer, *layout)]))

    def texture(self, pixels: Float32[ndarray, "H W c"]) -> moderngl.Texture:
        """Floats, unfiltered."""
        height, width, channels = pixels.shape
        content = np.ascontiguousarray(pixels, np.float32)
        return self._plain(self._kept(self.context.texture((width, height), channels, content, alignment=1, dtype="f4")))

    def target(self, size: tuple[int, int], channels: int, dtype: str) -> Target:
        """A texture to draw into, and its framebuffer."""
        texture = self._plain(self._kept(self.context.texture(size, channels, dtype=dtype)))
        texture.repeat_x = texture.repeat_y = False
        return texture, self._kept(self.context.framebuffer([texture]))

    def _plain(self, texture: moderngl.Texture) -> moderngl.Texture:
        texture.filter = (self.context.NEAREST, self.context.NEAREST)
        return texture

    def _kept(self, resource: Any) -> Any:
        """`resource`, registered for release."""
        self._made.callback(resource.release)
        return resource


class ProfileTextures:
    """Textures of profiles, which stay: lights of equal profiles share one."""

    def __init__(self, resources: Resources) -> None:
        self._resources = resources
        self._made: dict[Profile, moderngl.Texture] = {}

    def of(self, profile: Profile) -> moderngl.Texture:
        """Its table, for `lights/profile.glsl`."""
        if profile not in self._made:
            self._made[profile] = self._resources.texture(profile.table)
        return self._made[profile]


def render(array: moderngl.VertexArray, uniforms: dict[str, Any], vertices: int = -1) -> None:
    """Draw; a uniform that the program does not have is of another stage. `pointLight.` members: a dict under `pointLight`."""
    program = array.program
    for name, value in uniforms.items():
        if isinstance(value, dict):
            for member, part in value.items():
                _set(program, f"{name}.{member}", part)
        else:
            _set(program, name, value)
    array.render(vertices=vertices)


def _set(program: moderngl.Program, name: str, value: Any) -> None:
    uniform: Any = program.get(name, None)  # `name in program` would look through all of them
    if uniform is None:
        return
    if isinstance(value, np.ndarray):
        uniform.write(np.ascontiguousarray(value))
    else:
        uniform.value = value
