"""Programs of the shader pack, compiled when first run, each over one triangle that covers the target."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import numpy as np

from srbf.gl.context import compile_program
from srbf.gl.includes import Defines, resolve

if TYPE_CHECKING:
    import moderngl


class Programs:
    """Fragment stages by name and defines; released with `resources`."""

    def __init__(self, context: moderngl.Context, resources: ExitStack) -> None:
        self.context, self.resources = context, resources
        self._made: dict[tuple[str, tuple[tuple[str, object], ...]], moderngl.VertexArray] = {}
        self._corners = context.buffer(np.array([[-1, -1], [3, -1], [-1, 3]], np.float32))
        resources.callback(self._corners.release)

    def run(self, stage: str, defines: Defines, uniforms: dict[str, Any]) -> None:
        """Draw one stage over the whole of the target in use."""
        key = (stage, tuple(defines.items()))
        if key not in self._made:
            program = compile_program(self.context, resolve("stages/fullscreen.vert"), resolve(f"stages/{stage}", defines=defines))
            self.resources.callback(program.release)
            self._made[key] = self.context.vertex_array(program, [(self._corners, "2f", "corner")])
            self.resources.callback(self._made[key].release)
        vertex_array = self._made[key]
        program = vertex_array.program
        for name, content in uniforms.items():
            uniform: Any = program.get(name, None)
            if uniform is None:
                continue  # the driver drops a uniform that cannot change the result
            if isinstance(content, np.ndarray):
                uniform.write(np.ascontiguousarray(content))
            else:
                uniform.value = content
        vertex_array.render(vertices=3)

    def target(self, size: tuple[int, int]) -> tuple[moderngl.Texture, moderngl.Framebuffer]:
        """A texture RGBA32F of `size`, columns and rows, that is fetched by texel, and the framebuffer that draws into it."""
        texture = self.context.texture(size, 4, dtype="f4")
        texture.filter = (self.context.NEAREST, self.context.NEAREST)
        self.resources.callback(texture.release)
        framebuffer = self.context.framebuffer([texture])
        self.resources.callback(framebuffer.release)
        return texture, framebuffer


def ranges(total: int, size: int) -> Iterator[tuple[int, int]]:
    """(first, count) of runs of at most `size` that cover `total`."""
    for first in range(0, total, size):
        yield first, min(size, total - first)
