"""What the GPU tests share: one context, and single shader functions run on a grid."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import numpy as np
import pytest

from srbf.gl.context import compile_program, create_context
from srbf.gl.includes import resolve, resolve_text


@pytest.fixture(scope="session")
def context() -> Iterator[Any]:
    made = create_context()  # `make setup` sees to it: where there is none, these tests fail rather than pass unrun
    yield made
    made.release()


@pytest.fixture
def evaluate(context: Any) -> Callable[..., np.ndarray]:
    """evaluate(file, expression, *inputs): a vec4 expression of a, b, c ... (rows of (N, 4) inputs) and uv, as (N, 4) float32."""

    def run(
        file: str,
        expression: str,
        *inputs: np.ndarray,
        declarations: str = "",
        uniforms: dict[str, Any] | None = None,
        arrays: dict[str, np.ndarray] | None = None,
        images: dict[str, np.ndarray] | None = None,
        defines: dict[str, object] | None = None,
    ) -> np.ndarray:
        count = len(inputs[0])
        textures = {f"input{i}": np.asarray(x, np.float32)[None] for i, x in enumerate(inputs)} | (images or {})
        letters = [f"    vec4 {'abcdefg'[i]} = texelFetch(input{i}, at, 0);" for i in range(len(inputs))]
        text = "\n".join(
            [
                "precision highp float; precision highp int; precision highp sampler2D; precision highp sampler2DArray;",
                f'#include "{file}"',
                *(f"uniform sampler2D{'Array' if x.ndim == 4 else ''} {name};" for name, x in textures.items()),
                declarations,
                "layout(location = 0) out vec4 result;",
                "void main() {",
                "    ivec2 at = ivec2(gl_FragCoord.xy);",
                f"    vec2 uv = vec2(gl_FragCoord.x / {count}.0, 0.5);",
                *letters,
                f"    result = {expression};",
                "}",
            ]
        )
        with context, ExitStack() as made:

            def kept(resource: Any) -> Any:
                made.callback(resource.release)
                return resource

            source = resolve_text(text, "grid.frag", defines=defines)
            program = kept(compile_program(context, resolve("stages/fullscreen.vert"), source))
            for unit, (name, x) in enumerate(textures.items()):
                pixels, size = np.ascontiguousarray(x, np.float32), (x.shape[-2], x.shape[-3])
                if x.ndim == 4:
                    texture = kept(context.texture_array((*size, len(x)), x.shape[-1], pixels, alignment=1, dtype="f4"))
                else:
                    texture = kept(context.texture(size, x.shape[-1], pixels, alignment=1, dtype="f4"))
                texture.filter = (context.NEAREST, context.NEAREST)
                texture.use(unit)
                if name in program:
                    program[name].value = unit
            for name, value in (uniforms or {}).items():
                program[name].value = value
            for name, content in (arrays or {}).items():
                program[name].write(np.ascontiguousarray(content, np.float32))
            target = kept(context.framebuffer([kept(context.texture((count, 1), 4, dtype="f4"))]))
            corners = kept(context.buffer(np.array([[-1, -1], [3, -1], [-1, 3]], np.float32)))
            target.use()
            context.enable_only(context.NOTHING)
            kept(context.vertex_array(program, [(corners, "2f", "corner")])).render(vertices=3)
            return np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(count, 4).copy()

    return run
